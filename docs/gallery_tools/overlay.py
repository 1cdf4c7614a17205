"""Curves, nets and labels drawn over a picture of a model; what lies behind the model is drawn faintly."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw

from gallery_tools.drawing import PAPER, text, text_width
from upholster.base.types import FloatArray
from upholster.model.render.camera import Camera

__all__ = ["Overlay"]

FINE = 3
"""Lines are drawn so many times larger and then reduced: Pillow's are not smooth."""

Color = tuple[int, int, int]


class Overlay:
    """A transparent layer over a picture, in which places are given in the model's space.

    Parameters
    ----------
    picture
        Pillow image of `camera`'s size.
    camera
        Where it was taken from.
    depth
        (h, w): the picture's depths, see `upholster.model.render.picture.render`.
    slack
        How far behind the surface, in model units, a point still counts as visible.
    """

    def __init__(self, picture: Any, camera: Camera, depth: NDArray[np.float32], slack: float) -> None:
        self.picture, self.camera, self.depth, self.slack = picture, camera, depth, slack
        self.layer = Image.new("RGBA", (picture.width * FINE, picture.height * FINE))
        self.draw = ImageDraw.Draw(self.layer)

    def visible(self, points: FloatArray) -> NDArray[np.bool_]:
        """Tell which points (N, 3) nothing hides."""
        place = self.camera.project(points)
        column = np.clip(place[:, 0].astype(int), 0, self.depth.shape[1] - 1)
        row = np.clip(place[:, 1].astype(int), 0, self.depth.shape[0] - 1)
        # The deepest solid pixel around: at an outline, a pixel's one depth is not the curve's.
        around = [
            self.depth[
                np.clip(row + i, 0, len(self.depth) - 1), np.clip(column + j, 0, self.depth.shape[1] - 1)
            ]
            for i in (-1, 0, 1)
            for j in (-1, 0, 1)
        ]
        solid = np.where(np.isfinite(around), around, -np.inf).max(axis=0)
        return np.asarray((place[:, 2] <= solid + self.slack) | (solid == -np.inf))

    def curve(self, points: ArrayLike, color: Color, *, width: float = 2.0, hidden: int = 70) -> None:
        """Draw a polyline (N, 3); hidden parts with opacity `hidden` of 255. Put points close together."""
        line = np.asarray(points, np.float64)
        seen = self.visible(line)
        place = self.camera.project(line)[:, :2] * FINE
        both = seen[:-1] & seen[1:]
        for state in (False, True):
            opacity = 255 if state else hidden
            if opacity == 0:
                continue
            change = np.flatnonzero(np.diff(np.concatenate([[not state], both, [not state]]) == state))
            for start, stop in change.reshape(-1, 2):
                run = [(float(x), float(y)) for x, y in place[start : stop + 1]]
                self.draw.line(run, fill=(*color, opacity), width=max(1, round(width * FINE)), joint="curve")

    def segment(self, start: ArrayLike, stop: ArrayLike, color: Color, *, width: float = 2.0) -> None:
        """Draw a straight line between two points (3,)."""
        share = np.linspace(0, 1, 60)[:, None]
        self.curve((1 - share) * np.asarray(start) + share * np.asarray(stop), color, width=width)

    def dot(self, point: ArrayLike, color: Color, *, radius: float = 4.0) -> None:
        """Draw a dot, faint where the model hides it."""
        place = np.asarray(point, np.float64)[None]
        opacity = 255 if self.visible(place)[0] else 110
        (x, y), r = self.camera.project(place)[0, :2] * FINE, radius * FINE
        self.draw.ellipse((x - r, y - r, x + r, y + r), fill=(*color, opacity))

    def head(self, points: ArrayLike, color: Color, *, size: float = 16.0) -> None:
        """Draw an arrow head at the end of a polyline (N, 3)."""
        place = self.camera.project(points)[:, :2] * FINE
        tip = place[-1]
        before = place[max(0, len(place) - 4)]
        forward = (tip - before) / max(float(np.linalg.norm(tip - before)), 1e-9)
        aside = np.array([-forward[1], forward[0]])
        long, wide = size * FINE, 0.42 * size * FINE
        corners = [tip + 0.5 * long * forward, tip - 0.5 * long * forward + wide * aside]
        corners.append(corners[1] - 2 * wide * aside)
        self.draw.polygon([(float(x), float(y)) for x, y in corners], fill=(*color, 255))

    def polygon(self, points: ArrayLike, color: Color, opacity: int) -> None:
        """Fill a polygon (N, 3), if all its corners are visible."""
        corners = np.asarray(points, np.float64)
        if self.visible(corners).all():
            place = self.camera.project(corners)[:, :2] * FINE
            self.draw.polygon([(float(x), float(y)) for x, y in place], fill=(*color, opacity))

    def label(
        self, point: ArrayLike, words: str, *, shift: tuple[float, float], color: Color, size: int = 20
    ) -> None:
        """Write words on a light plate, centred at a point moved by `shift` pixels."""
        x, y = (self.camera.project(point)[:2] + np.array(shift)) * FINE
        high = size * FINE
        half = text_width(words, high) / 2 + 0.35 * high
        box = (x - half, y - 0.66 * high, x + half, y + 0.66 * high)
        self.draw.rounded_rectangle(box, radius=0.3 * high, fill=(*PAPER, 225))
        text(self.draw, (x, y), words, size=high, color=(*color, 255), align=0.5)

    def finish(self) -> Any:
        """Return the picture with the layer over it."""
        # Reduced with premultiplied alpha, or line ends would darken.
        values = np.asarray(self.layer, np.float32)
        alpha = values[..., 3:] / 255
        height, width = self.depth.shape
        blocks = np.concatenate([values[..., :3] * alpha, alpha], axis=2)
        mean = blocks.reshape(height, FINE, width, FINE, 4).mean(axis=(1, 3))
        under = np.asarray(self.picture, np.float32)
        result = under * (1 - mean[..., 3:]) + mean[..., :3]
        return Image.fromarray(result.round().astype(np.uint8))
