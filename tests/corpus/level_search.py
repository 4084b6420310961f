"""Run the product's search for iso-values on a case."""

from dataclasses import dataclass
from functools import partial
from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray

from corpus.case import Case, Mask
from stereocell.filters.background import find_background
from stereocell.filters.denoise import denoise
from stereocell.filters.noise import NoiseSample, find_max_shift
from stereocell.isosurface.channel_level import ChannelLevels, find_levels
from stereocell.isosurface.level_evidence import (
    HALO,
    MAX_PADDING,
    Counting,
    Slices,
    TileEvidence,
    denoising_reach,
    find_padding,
    gather_evidence,
)
from stereocell.isosurface.level_histogram import Scale
from stereocell.isosurface.options import SurfaceOptions
from stereocell.model.image_plane import find_slice_axis, slices_first
from stereocell.model.tiling import Box
from stereocell.model.volume import Volume


@dataclass(frozen=True)
class LevelSearch:
    """The fields, evidence and levels that the product finds for one case.

    field    denoised voxels, float32 (z, y, x), on which levels are found
    above    `field` minus the background; `field` itself if no background is estimated
    values   voxels from which a surface is extracted; minus the background if the levels are
    padding  voxels that are padding
    tiles    window and evidence of each tile
    """

    case: Case
    truth: Mask | None
    field: NDArray[np.float32]
    above: NDArray[np.float32]
    values: NDArray[np.float32]
    padding: Mask
    tiles: tuple[tuple[Slices, TileEvidence], ...]
    counting: Counting
    found: ChannelLevels


def search_levels(case: Case) -> LevelSearch:
    """Return the fields, evidence and levels of a case."""
    voxels, truth = case.load()
    sigma = min(case.spacing_um)
    axis = find_slice_axis(0, case.spacing_um)
    volume = Volume(voxels, case.spacing_um, slice_axis=axis)
    field = denoise(volume, sigma)
    darkest: float | None = float(voxels.min())
    padding = find_padding(voxels, darkest, denoising_reach(sigma, case.spacing_um, axis))
    if padding.mean() > MAX_PADDING:
        padding[...], darkest = False, None
    noise = NoiseSample()
    noise.add(slices_first(voxels, axis), float(voxels.min()))
    max_shift = find_max_shift(noise.deviation(), SurfaceOptions().max_shift, None)
    scale, scale_above, above, under = Scale.of(voxels, padding), None, field, None
    if case.kind == "microscopy":
        whole = Box((0, 0, 0), voxels.shape)
        lattice = find_background(
            voxels, whole, spacing_um=case.spacing_um, block_um=64 * sigma, padding=padding
        )
        under = np.broadcast_to(lattice.at(whole), field.shape)
        above = field - under
        scale_above = scale.above(lattice)
    counting = Counting(scale, scale_above, darkest)
    tiles = tuple(
        (
            place,
            gather_evidence(
                np.ascontiguousarray(field[window]),
                padding[window],
                own,
                voxels=voxels[window],
                spacing_um=case.spacing_um,
                counting=counting,
                start=tuple(side.start for side in place),
                background=None if under is None else partial(_slices_of, under[window]),
            ),
        )
        for place in _places(voxels.shape, case.grid)
        for window, own in [_with_halo(place, voxels.shape)]
    )
    found = find_levels(
        [evidence for _, evidence in tiles],
        counting=counting,
        finest_um=sigma,
        modality={"CT": "CT", "MR": "MR"}.get(case.kind, ""),
    )
    values = denoise(volume, sigma, max_shift)
    if found.subtracts and under is not None:
        values -= under
    return LevelSearch(case, truth, field, above, values, padding, tiles, counting, found)


def _slices_of(under: NDArray[np.float32], first: int, stop: int) -> NDArray[np.float32]:
    return under[first:stop]


def _places(shape: tuple[int, ...], grid: tuple[int, int]) -> list[Slices]:
    ends = [
        np.linspace(0, n, k + 1).astype(int).tolist() for n, k in zip(shape[1:], grid, strict=True)
    ]
    rows, columns = ([slice(a, b) for a, b in pairwise(axis)] for axis in ends)
    return [(slice(0, shape[0]), row, column) for row, column in product(rows, columns)]


def _with_halo(place: Slices, shape: tuple[int, ...]) -> tuple[Slices, Slices]:
    """Return the window of a tile with its halo, and the slices of the tile inside the window."""
    sides = [
        (max(s.start - halo, 0), min(s.stop + halo, n))
        for s, halo, n in zip(place, HALO, shape, strict=True)
    ]
    z, y, x = (slice(*side) for side in sides)
    own_z, own_y, own_x = (
        slice(s.start - low, s.stop - low) for s, (low, _) in zip(place, sides, strict=True)
    )
    return (z, y, x), (own_z, own_y, own_x)
