"""Find the iso-levels of a volume that fits into memory, for a notebook or a script."""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from stereocell.filters.background import find_background
from stereocell.filters.denoise import denoise
from stereocell.filters.noise import NoiseSample, find_max_shift
from stereocell.isosurface.channel_level import ChannelLevels, find_levels
from stereocell.isosurface.level_evidence import (
    MAX_PADDING,
    Counting,
    TileEvidence,
    denoising_reach,
    find_padding,
    gather_evidence,
)
from stereocell.isosurface.level_histogram import Scale
from stereocell.isosurface.options import SurfaceOptions
from stereocell.model.image_plane import (
    find_slice_axis,
    first_of_three,
    slices_back,
    slices_first,
)
from stereocell.model.lattice_field import LatticeField
from stereocell.model.tiling import Box
from stereocell.model.volume import Volume

_CALIBRATED = ("CT", "MR")
# Size of the background's blocks, in finest spacings; the same as the default of
# `surface.background_um`
_BLOCK_VOXELS = 64


@dataclass(frozen=True, slots=True)
class ArrayLevels:
    """The levels of one volume.

    below   mean of the subtracted background, in voxel values; 0 if none is subtracted
    field   float32 (z, y, x), voxel values: denoised, and less the background if
            `levels.subtracts`; the surface of a level lies where the field has the level's value
    levels  `levels.clear` are the levels whose surfaces can be relied on, outermost first
    """

    field: NDArray[np.float32]
    levels: ChannelLevels
    below: float


@dataclass(frozen=True, slots=True)
class ArrayEvidence:
    """The evidence for the levels of one volume.

    background  voxel values, knots in voxels along (slice, row, column); None: not estimated
    max_shift   largest change of a value by smoothing, in voxel values; None: no limit
    """

    counting: Counting
    evidence: TileEvidence
    background: LatticeField | None
    max_shift: float | None


def find_array_levels(
    volume: Volume, *, smoothing_um: float | None = None, modality: str = ""
) -> ArrayLevels:
    """Return the levels of a volume as a build of it finds them.

    volume        voxels (z, y, x) of any number type
    smoothing_um  sigma of the Gaussian; None: the finest spacing
    modality      DICOM's code; no background is subtracted from CT and MR

    >>> z, y, x = np.mgrid[:32, :32, :32] - 15.5
    >>> ball = np.where(z**2 + y**2 + x**2 < 100, 1000, 100).astype(np.uint16)
    >>> noisy = ball + np.random.default_rng(0).normal(0, 20, ball.shape)
    >>> found = find_array_levels(Volume(noisy.astype(np.float32), (1.0, 1.0, 1.0)))
    >>> 400 < found.levels.clear[0].value < 700
    True
    """
    found = gather_array_evidence(volume, smoothing_um=smoothing_um, modality=modality)
    finest_um = min(volume.spacing_um)
    levels = find_levels(
        [found.evidence], counting=found.counting, finest_um=finest_um, modality=modality
    )
    axis = find_slice_axis(volume.slice_axis, volume.spacing_um)
    spacing = first_of_three(volume.spacing_um, axis)
    turned = Volume(slices_first(volume.voxels, axis), spacing)
    sigma = finest_um if smoothing_um is None else smoothing_um
    field, below = denoise(turned, sigma, found.max_shift), 0.0
    if levels.subtracts and found.background is not None:
        background = found.background.at(Box((0, 0, 0), turned.voxels.shape))
        field, below = field - background, float(background.mean(dtype=np.float64))
    return ArrayLevels(np.ascontiguousarray(slices_back(field, axis)), levels, below)


def gather_array_evidence(
    volume: Volume, *, smoothing_um: float | None = None, modality: str = ""
) -> ArrayEvidence:
    """Return the evidence for a volume's levels. The arguments are those of `find_array_levels`."""
    axis = find_slice_axis(volume.slice_axis, volume.spacing_um)
    spacing = first_of_three(volume.spacing_um, axis)
    voxels = slices_first(volume.voxels, axis)
    sigma = min(spacing) if smoothing_um is None else smoothing_um
    field = denoise(Volume(voxels, spacing), sigma)
    darkest: float | None = float(voxels.min())
    padding = find_padding(voxels, darkest, denoising_reach(sigma, spacing, 0))
    if padding.mean() > MAX_PADDING:
        padding[...], darkest = False, None
    noise = NoiseSample()
    noise.add(voxels, darkest)
    max_shift = find_max_shift(noise.deviation(), SurfaceOptions().max_shift, None)
    scale, scale_above, lattice = Scale.of(voxels, padding), None, None
    whole = Box((0, 0, 0), voxels.shape)
    if modality not in _CALIBRATED:
        lattice = find_background(
            voxels,
            whole,
            spacing_um=spacing,
            block_um=_BLOCK_VOXELS * min(spacing),
            padding=padding,
        )
        scale_above = scale.above(lattice)
    counting = Counting(scale, scale_above, darkest)
    evidence = gather_evidence(
        field,
        padding,
        whole.slices,
        voxels=voxels,
        spacing_um=spacing,
        counting=counting,
        background=None if lattice is None else partial(_slices_of, lattice, whole),
    )
    return ArrayEvidence(counting, evidence, lattice, max_shift)


def _slices_of(background: LatticeField, whole: Box, first: int, stop: int) -> NDArray[np.float32]:
    return background.at(whole.slab(0, first, stop))
