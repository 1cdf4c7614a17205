"""The parts: evaluation of patches against geomdl and NumPy, the Haar transform against PyWavelets."""

import numpy as np
import pywt
from geomdl import NURBS

import upholster
from benchmarks.measure import Results, median_seconds
from upholster.model import tessellate
from upholster.wavelet import dwt2, idwt2

__all__ = ["parts"]


def parts(results: Results) -> None:
    """Time points per second on a grid, meshing, and the transform both ways."""
    _patches(results)
    _haar(results)


def _patches(results: Results) -> None:
    surface = upholster.ring_cyclide(6, 2, 3)
    patch = surface.patches[0]
    grid = np.linspace(0, 1, 2000)
    points = median_seconds(lambda: patch.points_grid(grid, grid))
    s, t = (values.reshape(-1)[:400_000] for values in np.meshgrid(grid, grid))
    numpy_rate = 400_000 / median_seconds(lambda: _numpy_points(patch.net, s, t)) / 1e6
    peer = NURBS.Surface()
    peer.degree_u = peer.degree_v = 2
    peer.ctrlpts2d = patch.net.tolist()
    peer.knotvector_u = peer.knotvector_v = [0, 0, 0, 1, 1, 1]
    peer.sample_size = 60
    peer_rate = 3600 / median_seconds(lambda: peer.evaluate(), runs=3) / 1e6
    results.add(
        "bi-quadratic patch, points on a grid",
        grid.size**2 / points / 1e6,
        "Mpoints/s",
        aim="at least 50",
        remark=f"geomdl {peer_rate:.2g}, NumPy scattered {numpy_rate:.2g}",
    )
    scattered = median_seconds(lambda: patch.points(s, t))
    results.add("the same, scattered", s.size / scattered / 1e6, "Mpoints/s")
    normals = median_seconds(lambda: patch.normals_grid(grid, grid))
    results.add("the same, unit normals on a grid", grid.size**2 / normals / 1e6, "Mpoints/s")
    mesh = median_seconds(lambda: tessellate(surface, quads=50_000))
    results.add("mesh of 50,000 quadrilaterals", 1000 * mesh, "ms")


def _numpy_points(net: np.ndarray, s: np.ndarray, t: np.ndarray) -> np.ndarray:
    basis_s = np.stack([(1 - s) ** 2, 2 * s * (1 - s), s**2])
    basis_t = np.stack([(1 - t) ** 2, 2 * t * (1 - t), t**2])
    homogeneous = np.zeros((s.size, 4))
    for i in range(3):
        for j in range(3):
            homogeneous += (basis_s[i] * basis_t[j])[:, None] * net[i, j]
    return homogeneous[:, :3] / homogeneous[:, 3:]


def _haar(results: Results) -> None:
    image = np.random.default_rng(0).uniform(0, 255, (512, 512, 3))
    ours, theirs = dwt2(image), pywt.wavedec2(image, "haar", level=3, axes=(0, 1))
    forward = median_seconds(lambda: dwt2(image), runs=15)
    inverse = median_seconds(lambda: idwt2(ours), runs=15)
    peer_forward = median_seconds(lambda: pywt.wavedec2(image, "haar", level=3, axes=(0, 1)), runs=15)
    peer_inverse = median_seconds(lambda: pywt.waverec2(theirs, "haar", axes=(0, 1)), runs=15)
    for name, our, peer in (("", forward, peer_forward), ("inverse ", inverse, peer_inverse)):
        results.add(
            f"{name}Haar transform, 512² RGB, 3 levels",
            1000 * our,
            "ms",
            remark=f"PyWavelets {1000 * peer:.3g} ms: {peer / our:.0f} times",
        )
