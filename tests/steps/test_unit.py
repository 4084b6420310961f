"""One unit in memory: its 8-bit volume, and the range of voxel values that it can process."""

from dataclasses import replace

import numpy as np
import pytest

from stereocell.isosurface.repair_options import RepairOptions
from stereocell.model.lattice import Lattice
from stereocell.model.lattice_field import LatticeField
from stereocell.model.tile_content import APRON
from stereocell.model.tiling import Box
from stereocell.model.volume import Volume
from stereocell.planning.settings import Settings
from stereocell.planning.unit_steps import unit_options
from stereocell.steps.unit import UnitInput, build_unit
from support.phantoms import blurred_ball

SPACING = (0.28, 0.14, 0.14)
SHAPE = (20, 40, 40)
BOX = Box((0, 0, 0), SHAPE)


def _given(scale: float) -> UnitInput:
    settings = Settings()
    settings = replace(settings, surface=settings.surface.resolved(SPACING))
    iso = LatticeField(((9.5,), (19.5,), (19.5,)), np.full((1, 1, 1), 0.5 * scale))
    repair, step = RepairOptions(0.6, 0.9, 1.2), (1, 1, 1)
    lattice = Lattice.of_whole(BOX, SPACING)
    return UnitInput(lattice, iso, None, repair, step, (0.0, scale), unit_options(settings))


@pytest.mark.parametrize("scale", [2.0**-100, 2.0**100])
def test_voxels_whose_squares_overflow_float32_give_the_same_unit(scale: float) -> None:
    ball = blurred_ball(SHAPE, SPACING, (2.7, 2.7, 2.7), 1.5, 0.2)
    plain = build_unit(Volume(ball, SPACING), _given(1.0))
    scaled = build_unit(Volume(ball * np.float32(scale), SPACING), _given(scale))
    np.testing.assert_array_equal(scaled.volume, plain.volume)
    assert len(plain.lods) == len(scaled.lods) == 4
    for a, b in zip(plain.lods, scaled.lods, strict=True):
        np.testing.assert_array_equal(a.mesh.positions, b.mesh.positions)
        np.testing.assert_array_equal(a.mesh.triangles, b.mesh.triangles)


def test_the_apron_has_the_neighbours_voxels_and_repeats_voxels_at_the_region_s_ends() -> None:
    voxels = np.arange(np.prod(SHAPE), dtype=np.float32).reshape(SHAPE) % 251
    lattice = Lattice(BOX, Box((0, 10, 20), (10, 20, 40)), BOX, SPACING, (0.0, 0.0, 0.0))
    given = replace(_given(1.0), lattice=lattice, intensity_window=(0.0, 255.0))
    unit = build_unit(Volume(voxels, SPACING), replace(given, iso=None))
    padded = np.pad(voxels, APRON, mode="edge")
    np.testing.assert_array_equal(unit.volume, padded[0:12, 10:22, 20:42])


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.int16, np.float32])
@pytest.mark.parametrize("window", [(0.0, 255.0), (20.0, 90.0)])
@pytest.mark.parametrize("bits", [16, 8])
def test_voxels_are_kept_as_measured_if_8_bits_lose_something_unless_8_bits_are_set(
    dtype: type, window: tuple[float, float], bits: int
) -> None:
    voxels = np.random.default_rng(3).integers(0, 127, SHAPE).astype(dtype)
    given = replace(_given(1.0), iso=None, intensity_window=window)
    options = replace(given.options, bits=bits)
    unit = build_unit(Volume(voxels, SPACING), replace(given, options=options))
    if bits == 8 or (dtype == np.uint8 and window == (0, 255)):
        assert unit.measured is None
        return
    assert unit.measured is not None
    assert unit.measured.dtype == dtype
    np.testing.assert_array_equal(unit.measured, np.pad(voxels, APRON, mode="edge"))


@pytest.mark.slow
def test_texels_are_compared_with_the_voxels_and_not_with_the_thinned_planes() -> None:
    given = replace(_given(1.0), step=(1, 3, 3))
    unwrap = replace(given.options.unwrap, maps=True, texel_um=0.02)
    given = replace(given, options=replace(given.options, unwrap=unwrap.resolved(SPACING)))
    ball = blurred_ball(SHAPE, SPACING, (2.7, 2.7, 2.7), 1.5, 0.2)
    assert build_unit(Volume(ball, SPACING), given).lods[1].mesh.uvs is not None
