"""Previews of a model that is being covered: coarse ones soon, and last the export's quilt.

Work runs in a thread of its own. It stops when the next preview of the same project begins: at the next
stage or task, or after a library call that can not be interrupted, whose result is kept.
"""

import contextlib
import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from threading import Thread

from upholster.apps.project.joint_progress import JointProgress, shares_of
from upholster.base.errors import CancelledError, check_whole
from upholster.covering.joint_work import painted_model
from upholster.covering.request import Request
from upholster.model.textured_model import TexturedModel
from upholster.quilt.model import Quilt
from upholster.runtime.parallel import Stop, cancelled_by, handed_on, reporting
from upholster.runtime.stages import Stages

__all__ = ["Look", "Preview", "Previews"]

_COARSEST = 20_000
"""Number of steps of the first look, about."""

_MOST_OCTAVES = 5

_BETWEEN = 3
"""Most octaves between two looks: an export of many steps has one more look on the way."""


@dataclass(frozen=True, eq=False, slots=True)
class Look:
    """A model as it is at some point of a preview.

    Attributes
    ----------
    model
        The model with its texels: `TexturedModel.picture`, `TexturedModel.view` …
    quilts
        The quilt of each sample.
    is_final
        Whether these are the quilts of the export.
    seconds
        Time since the preview began.
    """

    model: TexturedModel
    quilts: tuple[Quilt, ...]
    is_final: bool
    seconds: float


class Preview:
    """Looks at a model in order: an iterator. Made by `Project.preview`.

    It ends after the last look, or when it is cancelled.
    """

    def __init__(self, work: Callable[["Preview"], None]) -> None:
        self.began = time.perf_counter()
        self._stop, self._looks = Stop(), SimpleQueue[Look | BaseException | None]()
        self._thread = Thread(target=handed_on(self._run), args=(work,), daemon=True, name="preview")
        self._thread.start()

    def _run(self, work: Callable[["Preview"], None]) -> None:
        end: BaseException | None = None
        try:
            with cancelled_by(self._stop):
                work(self)
        except CancelledError:
            pass
        except BaseException as error:  # passed to the iterating caller
            end = error
        self._looks.put(end)

    def show(self, model: TexturedModel, quilts: Sequence[Quilt], *, is_final: bool) -> None:
        """Add a look."""
        self._looks.put(Look(model, tuple(quilts), is_final, time.perf_counter() - self.began))

    def cancel(self) -> None:
        """End it; returns immediately."""
        self._stop.set()

    @property
    def is_cancelled(self) -> bool:
        """Whether it was ended."""
        return self._stop.is_set()

    def wait(self, seconds: float | None = None) -> bool:
        """Wait until its work has stopped; return whether it has."""
        self._thread.join(seconds)
        return not self._thread.is_alive()

    def __iter__(self) -> Iterator[Look]:
        while not self._stop.is_set():
            with contextlib.suppress(Empty):
                found = self._looks.get(timeout=0.01)
                if not isinstance(found, Look):
                    self._looks.put(found)  # a later iteration ends the same way
                    if found is None:
                        return
                    raise found
                yield found


class Previews:
    """The previews of a project and of all projects made from it, one at a time; and their kept results.

    Attributes
    ----------
    stages
        The kept results.
    """

    def __init__(self) -> None:
        self.stages = Stages()
        self._running: Preview | None = None

    def begin(self, read: Callable[[], list[Request]], texels: int) -> Preview:
        """Begin a preview, replacing the current one; see `Project.preview`."""
        texels = check_whole("texels", texels, 1000, 2**26)
        self.cancel()
        joint = JointProgress()

        def work(preview: Preview) -> None:
            with self.stages.active(), reporting(joint):
                requests = read()
                looks = (*_octaves(requests), 0)
                sizes = [[each.texels / 4**octaves for each in requests] for octaves in looks]
                for octaves, shares in zip(looks, shares_of(sizes), strict=True):
                    quilts = []
                    for each, share in zip(requests, shares, strict=True):
                        joint.begin(*share)
                        quilts.append(each.quilt(octaves))
                    model = painted_model(requests, quilts, texels=texels)
                    preview.show(model, quilts, is_final=octaves == 0)

        self._running = Preview(work)
        return self._running

    def cancel(self) -> None:
        """End the running preview, if there is one."""
        if self._running is not None:
            self._running.cancel()


def _octaves(requests: Sequence[Request]) -> list[int]:
    """Return, for each look before the last, by how many powers of two its steps are longer."""
    if any(each.synthesis.method != "quilt" for each in requests):
        return []
    steps = sum(chart.height * chart.width for each in requests for chart in each.scene.charts)
    first = round(math.log(steps / _COARSEST, 4)) if steps > _COARSEST else 0
    return list(range(min(first, _MOST_OCTAVES), 0, -_BETWEEN))
