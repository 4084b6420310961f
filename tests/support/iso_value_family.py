"""Tiles of known solids: bodies x brightness x noise x background x share of foreground.

Criteria for an iso-value are chosen and tested on these tiles. The module does not use stereocell.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

SPACING = (0.28, 0.14, 0.14)  # um, (z, y, x)
SHAPE = (48, 128, 128)
BLUR_UM = (0.35, 0.16, 0.16)  # um; wider along z, as in a microscope
HOT_SHARE, READ_NOISE, GAIN, OFFSET = 2e-5, 2.0, 4.0, 100.0
_EXTENT = (np.array(SHAPE) - 1) * SPACING

Mask = NDArray[np.bool_]
Field = NDArray[np.float32]


@dataclass(frozen=True)
class Member:
    """One tile.

    share       share of the voxels in the bodies
    brightest   ratio of the brightest body to the dimmest
    photons     mean photons in a voxel of the dimmest body
    background  factor of the uneven background
    """

    kind: str
    share: float
    brightest: float
    photons: float
    background: float


def family() -> Iterator[Member]:
    """Yield all members."""
    for values in product(
        ("balls", "tubes", "membranes"), (0.01, 0.05, 0.15, 0.4), (1, 8), (10, 40, 200), (0, 1)
    ):
        yield Member(*values)


def make(member: Member, seed: int) -> tuple[Mask, NDArray[np.uint16]]:
    """Return the solids and the counts of a member, (z, y, x)."""
    rng = np.random.default_rng([seed, *(int(100 * v) for v in (
        member.share, member.brightest, member.photons, member.background))])  # fmt: skip
    mask, height = _BODIES[member.kind](rng, member.share, member.brightest)
    image = ndimage.gaussian_filter(height, np.array(BLUR_UM) / SPACING)
    z, y, x = (axis / end for axis, end in zip(_axes(), _EXTENT, strict=True))
    phase = rng.uniform(0, 2 * np.pi, 2)
    wave = np.sin(1.6 * np.pi * y + phase[0]) * np.cos(1.4 * np.pi * x + phase[1])
    image = image + 0.5 + member.background * (0.5 + 0.5 * wave + 0.5 * z)
    counts = rng.poisson(image * member.photons) + rng.normal(0, READ_NOISE, SHAPE)
    counts[rng.uniform(size=SHAPE) < HOT_SHARE] += 20 * member.photons
    return mask, np.clip(np.rint(counts * GAIN + OFFSET), 0, 65535).astype(np.uint16)


def dice(found: Mask, truth: Mask) -> float:
    """Return the Dice coefficient: twice the intersection over the sum of both volumes."""
    return float(2 * (found & truth).sum() / max(1, found.sum() + truth.sum()))


def _axes() -> tuple[Field, Field, Field]:
    z, y, x = (np.arange(n, dtype=np.float32) * h for n, h in zip(SHAPE, SPACING, strict=True))
    return z[:, None, None], y[:, None], x


def _brightness(rng: np.random.Generator, brightest: float, count: int) -> NDArray[np.float64]:
    return np.exp(rng.uniform(0, np.log(brightest), count)) if brightest > 1 else np.ones(count)


def _balls(rng: np.random.Generator, share: float, brightest: float) -> tuple[Mask, Field]:
    z, y, x = _axes()
    mask, height = np.zeros(SHAPE, bool), np.zeros(SHAPE, np.float32)
    while mask.mean() < share:
        radius = rng.uniform(1.2, 2.6)
        a, b, c = rng.uniform(-0.5, 0.5, 3) * (_EXTENT + 0.6 * radius) + _EXTENT / 2
        ball = (z - a) ** 2 + (y - b) ** 2 + (x - c) ** 2 < radius**2
        height[ball & ~mask] = _brightness(rng, brightest, 1)[0]
        mask |= ball
    return mask, height


def _tubes(rng: np.random.Generator, share: float, brightest: float) -> tuple[Mask, Field]:
    places = np.stack(np.broadcast_arrays(*_axes()), -1)
    mask, height = np.zeros(SHAPE, bool), np.zeros(SHAPE, np.float32)
    while mask.mean() < share:
        way = rng.normal(size=3)
        way /= np.linalg.norm(way)
        offset = places - rng.uniform(0, 1, 3) * _EXTENT
        tube = (offset**2).sum(-1) - (offset @ way) ** 2 < rng.uniform(0.5, 1.1) ** 2
        height[tube & ~mask] = _brightness(rng, brightest, 1)[0]
        mask |= tube
    return mask, height


def _membranes(rng: np.random.Generator, share: float, brightest: float) -> tuple[Mask, Field]:
    """Return walls of 0.56 um between Voronoi cells; walls are left out to reach the share."""
    count = max(4, int(300 * share))
    centres = rng.uniform(0, 1, (count, 3)) * _EXTENT
    places = np.stack(np.broadcast_arrays(*_axes()), -1).reshape(-1, 3)
    away, cell = cKDTree(centres).query(places, k=2)
    gap = np.linalg.norm(centres[cell[:, 0]] - centres[cell[:, 1]], axis=1)
    near = (away[:, 1] ** 2 - away[:, 0] ** 2) / (2 * gap) < 0.28
    wall = cell.min(axis=1) * count + cell.max(axis=1)
    size = np.bincount(wall[near], minlength=count**2)
    order = rng.permutation(np.flatnonzero(size))
    kept = np.zeros(count**2, bool)
    kept[order[: 1 + np.searchsorted(np.cumsum(size[order]), share * len(wall))]] = True
    mask = near & kept[wall]
    height = np.where(mask, _brightness(rng, brightest, count**2)[wall], 0)
    return mask.reshape(SHAPE), height.astype(np.float32).reshape(SHAPE)


_BODIES = {"balls": _balls, "tubes": _tubes, "membranes": _membranes}
