"""Thin sheets and shells in all orientations, in volumes of thick and thin slices, after filters.

The unfiltered voxels hold the whole body in one component, and are the reference for filtered ones.
In noise, a voxel that stands out by less than the noise may be lost.
"""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.filters.denoise import denoise
from stereocell.filters.noise import NoiseSample, find_max_shift
from stereocell.model.image_plane import slices_first
from stereocell.model.volume import Volume
from support.exhaustive import IS_EXHAUSTIVE
from support.thin_shells import BODY, GROUND, NORMALS, ThinBody, count_components, thin_bodies

CONTRAST = BODY - GROUND
QUARTER = GROUND + 0.25 * CONTRAST
HALF = GROUND + 0.5 * CONTRAST
DEVIATIONS = 2.0


@cache
def _source(body: ThinBody) -> NDArray[np.float32]:
    return body.voxels()


@cache
def _filtered(body: ThinBody, noise: float = 0.0) -> NDArray[np.float32]:
    voxels, sample = body.voxels(noise), NoiseSample()
    sample.add(slices_first(voxels, body.slice_axis))
    shift = find_max_shift(sample.deviation(), DEVIATIONS, None)
    volume = Volume(voxels, body.spacing, slice_axis=body.slice_axis)
    return denoise(volume, min(body.spacing), shift)


def _least_kept(
    level: float, is_asked: Callable[[ThinBody], bool], noise: float = 0.0
) -> tuple[float, ThinBody]:
    """Return the smallest share of a body's voxels above the level after filters, and the body."""
    shares = []
    for body in filter(is_asked, thin_bodies()):
        source, field = _source(body) > level, _filtered(body, noise)
        shares.append((float((field > level)[source].mean()), body))
    return min(shares, key=lambda pair: pair[0])


@pytest.mark.parametrize(
    ("level", "thinnest"), [(QUARTER, 0.5), (HALF, 1.0)], ids=["quarter", "half"]
)
def test_walls_from_half_a_voxel_up_stay_in_all_orientations_and_spacings(
    level: float, thinnest: float
) -> None:
    share, body = _least_kept(level, lambda body: body.thickness >= thinnest)
    assert share > 0.93, body


@pytest.mark.parametrize("level", [QUARTER, HALF], ids=["quarter", "half"])
def test_a_shell_in_one_piece_is_not_torn_into_rings(level: float) -> None:
    whole = 0
    for body in thin_bodies():
        source = _source(body) > level
        if source.sum() < 50 or count_components(source) > 1:
            continue
        whole += 1
        assert count_components((_filtered(body) > level) & source) == 1, body
    assert whole > (100 if IS_EXHAUSTIVE else 40)


def test_sheets_of_a_voxel_stay_in_noise_of_a_twentieth_of_their_height() -> None:
    """At a quarter of their height they stand out by 15 deviations; 3 of these may be noise."""
    noise = 0.05 * CONTRAST
    share, body = _least_kept(
        QUARTER, lambda body: body.shape in NORMALS and body.thickness >= 1.5, noise
    )
    assert share > 0.93, body


def test_the_gaussian_alone_removes_a_sheet_of_one_voxel() -> None:
    """The sheet's centre keeps erf(1 / sqrt 8) = .38 of its height, less than a half."""
    body = ThinBody("across x", 1, 1, 0)
    volume = Volume(body.voxels(), body.spacing)
    source = volume.voxels > HALF
    assert source.any()
    assert not (denoise(volume, 1.0) > HALF).any()
    assert (_filtered(body) > HALF)[source].all()
