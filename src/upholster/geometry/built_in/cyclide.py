"""The ring Dupin cyclide and the torus, exactly, as bi-quadratic rational patches."""

import math
from numbers import Real

import numpy as np

from upholster.base.errors import InputError
from upholster.geometry.built_in.circle import unit_circle
from upholster.geometry.built_in.parameter_checks import LARGEST_LENGTH, check_length, check_spans
from upholster.geometry.patches.face import grid_face
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface

__all__ = ["ring_cyclide", "torus"]


def ring_cyclide(
    a: float = 6.0, c: float = 2.0, mu: float = 3.0, *, spans: tuple[int, int] = (4, 4)
) -> Surface:
    """Build the ring Dupin cyclide: a closed ring, thick on one side and thin on the other.

    It lies in the plane z = 0, mirrored by y → −y and by z → −z, and satisfies, with b² = a² − c², ``(x² + y²
    + z² − µ² + b²)² = 4·(a·x − c·µ)² + 4·b²·y²``. Rows go once round the ring, from the point of the positive
    x axis towards +y; columns go round the tube, from the hole downward. The defaults are the example of
    Shene's cyclide papers and of the texture paper: 16 patches.

    Parameters
    ----------
    a
        Size of the ring: in the plane z = 0 it is bounded by the circles of radius a + µ round (−c, 0) and,
        the hole's, of radius a − µ round (c, 0). In the model's units: 1e-9 to 1e9.
    c
        How uneven the ring is, 0 ≤ c < a: the tube's radius runs from µ − c (on the +x side) to µ + c; 0
        gives the torus. In the model's units.
    mu
        Mean radius of the tube, c < µ ≤ a; at µ = a the hole closes to a point. In the model's units.
    spans
        Patches round the ring and round the tube: even numbers from 4 to 256.

    Raises
    ------
    InputError
        If a parameter is outside its range.

    References
    ----------
    Implicit and trigonometric form: V. Chandru, D. Dutta, C. M. Hoffmann, *On the geometry of Dupin
    cyclides*, The Visual Computer 5, 1989. Each arc of θ and of φ is put in rational quadratic form, which
    makes the product bi-quadratic; with even spans all weights are positive.
    """
    a = check_length("a", a)
    c = check_length("c", c, zero=True)
    if not c < a:
        raise InputError(f"c is {c:g}; allowed: 0 <= c < a = {a:g}")
    if not (isinstance(mu, Real) and c < mu <= a):
        raise InputError(f"mu is {mu!r}; allowed: c = {c:g} < mu <= a = {a:g}")
    rows, columns = _spans(spans)
    b = math.sqrt((a - c) * (a + c))
    # half angles; odd ones are the middle control points
    theta, phi = unit_circle(2 * rows), unit_circle(2 * columns)
    middle_theta, middle_phi = math.cos(math.pi / rows), math.cos(math.pi / columns)
    patches = []
    for p in range(rows):
        d = np.array([1.0, middle_theta, 1.0])[:, None]
        x_theta, y_theta = theta[2 * p : 2 * p + 3, :1], theta[2 * p : 2 * p + 3, 1:]
        for q in range(columns):
            e = np.array([1.0, middle_phi, 1.0])
            x_phi, z_phi = phi[2 * q : 2 * q + 3, 0], phi[2 * q : 2 * q + 3, 1]
            w = a * d * e - c * x_theta * x_phi
            x = mu * (c * d * e - a * x_theta * x_phi) + b * b * x_theta * e
            y = b * (a * e - mu * x_phi) * y_theta
            z = b * (c * x_theta - mu * d) * z_phi
            patches.append(RationalPatch(np.stack([x, y, z, w], axis=-1)))
    face = grid_face(patches, columns)
    return Surface.built_in("cyclide", [face], a=a, c=c, mu=float(mu), spans=(rows, columns))


def torus(R: float = 2.0, r: float = 0.7, *, spans: tuple[int, int] = (4, 4)) -> Surface:
    """Build the torus round the z axis: the cyclide with a = R, c = 0, µ = r.

    Rows go round the z axis, counter-clockwise seen from above; columns go round the tube, from the hole
    downward.

    Parameters
    ----------
    R
        Radius of the circle in the tube's middle, in the model's units: r < R.
    r
        Radius of the tube, in the model's units.
    spans
        Patches round the ring and round the tube: even numbers from 4 to 256.

    Raises
    ------
    InputError
        If a parameter is outside its range.
    """
    R, r = check_length("R", R), check_length("r", r)
    if not r < R:
        raise InputError(f"r is {r:g}; allowed: {1 / LARGEST_LENGTH:g} <= r < R = {R:g}")
    ring = ring_cyclide(R, 0.0, r, spans=spans)
    return Surface.built_in("torus", ring.faces, R=R, r=r, spans=(int(spans[0]), int(spans[1])))


def _spans(spans: tuple[int, int]) -> tuple[int, int]:
    """Check the two numbers of spans."""
    if not (isinstance(spans, tuple | list) and len(spans) == 2):
        raise InputError(f"spans is {spans}; allowed: two even numbers from 4 to 256")
    return (
        check_spans("spans round the ring", spans[0], least=4, even=True),
        check_spans("spans round the tube", spans[1], least=4, even=True),
    )
