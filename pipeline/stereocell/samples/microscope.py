"""A model of a confocal microscope that records the tissue: dye, blur, background and noise.

Each dye is drawn from signed distances, with a ramp one sample wide over the surface for partial
volumes. The samples are as fine along z as along y and x. They are averaged into voxels and blurred
by a Gaussian; an uneven background is added. Poisson noise of photons and Gaussian noise of the
camera follow. A box is drawn from the bodies that reach into it, so that any part of the block can
be computed on its own.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.model.tiling import Box
from stereocell.samples.bodies import Points, Triple, Values
from stereocell.samples.cycif_geometry import Tissue

Field = NDArray[np.float32]

SPACING_UM: Triple = (0.28, 0.14, 0.14)  # um (z, y, x)
BLUR_UM: Triple = (0.30, 0.12, 0.12)  # um, sigma (z, y, x); wider along z, as in an objective
OFFSET = 100.0  # counts of a dark voxel
GAIN = 1.5  # counts per photo-electron
READ_NOISE = 4.0  # counts, sigma of the camera's noise
MEMBRANE_UM = 0.5  # um, thickness of a cell's membrane
CYTOPLASM = 0.3  # brightness of the cytoplasm, as a share of the membrane's
WALL_UM = 0.7  # um, thickness of a vessel's wall
CHROMATIN = 0.2  # amplitude of clumps inside a nucleus, as a share of its dye
CHROMATIN_FROM_UM = 0.4  # um below the surface at which clumps begin; they are full at twice this
_TRUNCATE = 4.0  # sigmas at which the Gaussian is cut off
_SAMPLES = 2  # samples along z in a voxel, which makes the samples cubes


@dataclass(frozen=True, slots=True)
class Wave:
    """One cosine of the background: weight * cos(k . position + phase); k (z, y, x) in rad/um."""

    k: Triple
    phase: float
    weight: float


@dataclass(frozen=True, slots=True)
class Stain:
    """One channel. `amplitude` and `background` are counts above OFFSET, at brightness 1."""

    name: str
    color: str  # sRGB, hexadecimal
    amplitude: float
    background: float


STAINS = (
    Stain("Hoechst", "4F70F5", 1000.0, 120.0),
    Stain("MART1", "F0CD3C", 900.0, 140.0),
    Stain("CD31", "B4566E", 900.0, 110.0),
)


def waves_of(stain: int, size_um: Triple, seed: int) -> tuple[Wave, ...]:
    """Return the waves of a stain's uneven background. Their weights add up to 0.45."""
    rng = np.random.default_rng([seed, 1, stain])
    longest = max(size_um)
    waves = []
    for weight in (0.25, 0.12, 0.08):
        angle = rng.uniform(0.0, 2.0 * np.pi)
        k = 2.0 * np.pi / (longest * rng.uniform(0.35, 0.9))
        tilt = float(rng.uniform(-0.5, 0.5))
        direction = (tilt * k, float(np.sin(angle)) * k, float(np.cos(angle)) * k)
        waves.append(Wave(direction, float(rng.uniform(0.0, 2.0 * np.pi)), weight))
    return tuple(waves)


def background(stain: Stain, waves: tuple[Wave, ...], points: Points) -> Values:
    """Return the background in counts, offset included, at points z, y, x in um, float64."""
    z, y, x = points
    level = np.ones(np.broadcast_shapes(z.shape, y.shape, x.shape))
    for wave in waves:
        kz, ky, kx = wave.k
        in_plane = ky * y + kx * x + wave.phase
        # cos(a + b) is expanded, so that a grid needs cosines of one line and one plane only.
        level += wave.weight * (
            np.cos(kz * z) * np.cos(in_plane) - np.sin(kz * z) * np.sin(in_plane)
        )
    return OFFSET + stain.background * level


def record(tissue: Tissue, stain: int, *, box: Box, seed: int) -> NDArray[np.uint16]:
    """Return the voxels (z, y, x), uint16 counts, of a box in one channel.

    Another box that overlaps this one repeats the dye, but has other noise.
    """
    halo = [int(np.ceil(_TRUNCATE * b / h)) for b, h in zip(BLUR_UM, SPACING_UM, strict=True)]
    canvas = _Canvas(box, (halo[0], halo[1], halo[2]))
    dye = DRAW[STAINS[stain].name](tissue, canvas)
    sigma = [b / h for b, h in zip(BLUR_UM, SPACING_UM, strict=True)]
    blurred = ndimage.gaussian_filter(canvas.in_voxels(dye), sigma, truncate=_TRUNCATE)
    inner = tuple(slice(n, size - n) for n, size in zip(halo, blurred.shape, strict=True))
    waves = waves_of(stain, tissue.size_um, seed)
    clean = background(STAINS[stain], waves, _positions(box)).astype(np.float32)
    clean += STAINS[stain].amplitude * blurred[inner]

    rng = np.random.default_rng([seed, 2, stain, *box.start])
    counts = OFFSET + GAIN * rng.poisson((clean - OFFSET) / GAIN).astype(np.float32)
    counts += READ_NOISE * rng.standard_normal(clean.shape, dtype=np.float32)
    return np.clip(np.rint(counts), 0, 65535).astype(np.uint16)


class _Canvas:
    """Cubic samples over a box and its halo, on which bodies are drawn."""

    def __init__(self, box: Box, halo: tuple[int, int, int]) -> None:
        starts = [a - h for a, h in zip(box.start, halo, strict=True)]
        counts = [n + 2 * h for n, h in zip(box.shape, halo, strict=True)]
        z = (np.arange(counts[0] * _SAMPLES) + 0.5) / _SAMPLES - 0.5 + starts[0]
        self.axes = (
            z * SPACING_UM[0],
            (np.arange(counts[1]) + starts[1]) * SPACING_UM[1],
            (np.arange(counts[2]) + starts[2]) * SPACING_UM[2],
        )
        self.shape = tuple(len(axis) for axis in self.axes)
        self.width_um = SPACING_UM[2]

    def around(
        self, low_um: Triple, high_um: Triple
    ) -> tuple[tuple[slice, slice, slice], Points] | None:
        """Return the samples between two corners (z, y, x), and their points in um.

        Returns None if no sample lies there.
        """
        pad = 2.0 * self.width_um
        z, y, x = (
            slice(*(int(i) for i in np.searchsorted(axis, (a - pad, b + pad))))
            for axis, a, b in zip(self.axes, low_um, high_um, strict=True)
        )
        if min(z.stop - z.start, y.stop - y.start, x.stop - x.start) <= 0:
            return None
        return (z, y, x), _open_grid(self.axes[0][z], self.axes[1][y], self.axes[2][x])

    def share_inside(self, distance: NDArray[np.floating[Any]]) -> Field:
        """Return the share of each sample that lies inside, 0..1, from signed distances in um."""
        share: Field = np.clip(0.5 - distance / self.width_um, 0.0, 1.0).astype(np.float32)
        return share

    def in_voxels(self, samples: Field) -> Field:
        """Return the mean of each voxel's samples, float32 (z, y, x)."""
        depth, height, width = samples.shape
        means: Field = samples.reshape(depth // _SAMPLES, _SAMPLES, height, width).mean(axis=1)
        return means


def _draw_nuclei(tissue: Tissue, canvas: _Canvas) -> Field:
    dye = np.zeros(canvas.shape, np.float32)
    for nucleus in tissue.nuclei:
        found = canvas.around(*_corners(nucleus.center_um, nucleus.reach_um))
        if found is not None:
            where, points = found
            distance = nucleus.distance(points)
            # Chromatin begins below the surface. At the surface the dye is even, as in the truth.
            depth = np.clip((-distance - CHROMATIN_FROM_UM) / CHROMATIN_FROM_UM, 0.0, 1.0)
            even = nucleus.brightness * (1.0 + CHROMATIN * depth * _chromatin(points))
            dye[where] = np.maximum(dye[where], even * canvas.share_inside(distance))
    return dye


def _chromatin(points: Points) -> Values:
    """Return clumps about 1.5 um apart, -1..1, made of slanted waves that bend each other."""
    z, y, x = points
    a = 3.1 * z + 2.9 * y + 1.0 * x
    b = 0.9 * z - 2.4 * y + 3.7 * x
    c = 2.5 * z + 1.9 * y - 3.3 * x
    clumps: Values = np.sin(a + 1.4 * np.sin(b)) * np.sin(b + 1.4 * np.sin(0.7 * c + 0.5 * a))
    return clumps


def _draw_membranes(tissue: Tissue, canvas: _Canvas) -> Field:
    """Draw tumour cells: balls with a flat wall where two overlap, like soap bubbles."""
    nearest = np.full(canvas.shape, 1e3, np.float32)
    second = np.full(canvas.shape, 1e3, np.float32)
    brightness = np.zeros(canvas.shape, np.float32)
    for cell in tissue.nuclei:
        found = canvas.around(*_corners(cell.center_um, cell.cell_um))
        if cell.cell_um == 0.0 or found is None:
            continue
        where, points = found
        distance = cell.cell_distance(points).astype(np.float32)
        wins = distance < nearest[where]
        np.minimum(second[where], np.where(wins, nearest[where], distance), out=second[where])
        brightness[where][wins] = cell.brightness
        np.minimum(nearest[where], distance, out=nearest[where])
    depth = np.minimum(-nearest, (second - nearest) / 2.0)  # um inside the cell's own boundary
    body = canvas.share_inside(nearest)
    inner = canvas.share_inside(MEMBRANE_UM - depth)
    plasma = inner.copy()
    for nucleus in tissue.nuclei:
        found = canvas.around(*_corners(nucleus.center_um, nucleus.reach_um))
        if found is not None:
            where, points = found
            plasma[where] *= 1.0 - canvas.share_inside(nucleus.distance(points))
    dye: Field = brightness * (body - inner + CYTOPLASM * plasma)
    return dye


def _draw_vessels(tissue: Tissue, canvas: _Canvas) -> Field:
    """Draw tubes with a wall and an open lumen that continues through the forks."""
    outer = np.full(canvas.shape, 1e3, np.float32)
    for tube in tissue.vessels:
        found = canvas.around(tube.low_um, tube.high_um)
        if found is not None:
            where, points = found
            outer[where] = np.minimum(outer[where], tube.distance(points))
    wall: Field = canvas.share_inside(outer) - canvas.share_inside(outer + WALL_UM)
    return wall


DRAW: dict[str, Callable[[Tissue, _Canvas], Field]] = {
    "Hoechst": _draw_nuclei,
    "MART1": _draw_membranes,
    "CD31": _draw_vessels,
}


def _corners(center_um: Triple, reach_um: float) -> tuple[Triple, Triple]:
    z, y, x = center_um
    return (z - reach_um, y - reach_um, x - reach_um), (z + reach_um, y + reach_um, x + reach_um)


def _positions(box: Box) -> Points:
    z, y, x = (np.arange(a, b) * h for a, b, h in zip(box.start, box.stop, SPACING_UM, strict=True))
    return _open_grid(z, y, x)


def _open_grid(z: NDArray[Any], y: NDArray[Any], x: NDArray[Any]) -> Points:
    return z[:, None, None], y[None, :, None], x[None, None, :]
