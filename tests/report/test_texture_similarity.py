"""A coarse level with its maps looks like the finest: SSIM at five views."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from stereocell.isosurface.array_levels import find_array_levels
from stereocell.isosurface.repair_options import RepairOptions
from stereocell.model.lattice import Lattice
from stereocell.model.lattice_field import LatticeField
from stereocell.model.mesh import Lod
from stereocell.model.tiling import Box
from stereocell.model.volume import Volume
from stereocell.planning.settings import Settings
from stereocell.planning.unit_steps import unit_options
from stereocell.report.texture_similarity import CLOSE_PX, VIEWS, compare, draw, find_likeness
from stereocell.samples.cycif_geometry import grow_tissue
from stereocell.samples.microscope import SPACING_UM, STAINS, record
from stereocell.steps.unit import UnitInput, build_unit
from support.exhaustive import sweep

SPACING = (1.0, 1.0, 1.0)
BOX = Box((0, 0, 0), (56, 72, 72))


@pytest.fixture(scope="module")
def lods() -> tuple[Lod, ...]:
    """Lumpy cells close to each other."""
    rng = np.random.default_rng(5)
    grid = np.indices(BOX.shape).transpose(1, 2, 3, 0)
    inside = np.zeros(BOX.shape)
    for _ in range(14):
        middle = rng.uniform([10, 10, 10], np.array(BOX.shape) - 10)
        inside = np.maximum(inside, np.linalg.norm(grid - middle, axis=-1) < rng.uniform(6, 11))
    lumps = ndimage.gaussian_filter(rng.normal(size=BOX.shape), 2.5)
    field = ndimage.gaussian_filter(inside, 1.2) + 0.12 * lumps / lumps.std()
    settings = Settings()
    settings = replace(
        settings,
        surface=settings.surface.resolved(SPACING),
        unwrap=replace(settings.unwrap, maps=True).resolved(SPACING),
    )
    iso = LatticeField(((28.0,), (36.0,), (36.0,)), np.full((1, 1, 1), 500.0))
    given = UnitInput(
        lattice=Lattice(BOX, BOX, BOX, SPACING, (0.0, 0.0, 0.0)),
        iso=iso,
        background=None,
        repair=RepairOptions(2.0, 3.0, 4.0),
        step=(1, 1, 1),
        intensity_window=(0.0, 1000.0),
        options=unit_options(settings),
    )
    volume = Volume((1000 * field).astype(np.float32), SPACING)
    return build_unit(volume, given).lods


@pytest.mark.slow
@pytest.mark.parametrize(("level", "least"), [(1, 0.95), (2, 0.94)])
def test_level_with_maps_looks_like_the_finest(
    lods: tuple[Lod, ...], level: int, least: float
) -> None:
    """The mean SSIM of five views is .95 or more. Maps reduce 1 - SSIM by a fifth or more."""
    coarse = lods[level]
    assert len(coarse.mesh.triangles) < 0.6 * len(lods[0].mesh.triangles)
    found = find_likeness(lods[0], coarse)
    bare = find_likeness(lods[0], replace(coarse, normal_map=None, baked=None))
    assert len(found) == len(VIEWS) == 5
    assert np.mean(found) >= 0.95
    assert min(found) >= least
    assert 1 - np.mean(found) < 0.8 * (1 - np.mean(bare))


@pytest.mark.slow
@pytest.mark.parametrize("stain", sweep(range(len(STAINS)), kept=[1]))
def test_coarsest_level_has_the_finest_s_outlines(stain: int) -> None:
    """The SSIM of the outlines from near is .9 or more for nuclei, membranes and vessels."""
    box = Box((0, 0, 0), (48, 96, 96))
    depth, height, width = (n * h for n, h in zip(box.shape, SPACING_UM, strict=True))
    tissue = grow_tissue((depth, height, width), 0, 1.0)
    volume = Volume(record(tissue, stain, box=box, seed=0), SPACING_UM)
    level = find_array_levels(volume).levels.clear[0].value
    settings = Settings()
    given = UnitInput(
        lattice=Lattice.of_whole(box, SPACING_UM),
        iso=LatticeField(((0.0,), (0.0,), (0.0,)), np.full((1, 1, 1), level)),
        background=None,
        repair=RepairOptions(0.6, 0.9, 1.2),
        step=(1, 1, 1),
        intensity_window=(0.0, float(volume.voxels.max())),
        options=unit_options(replace(settings, surface=settings.surface.resolved(SPACING_UM))),
    )
    fine, *_, coarse = build_unit(volume, given).lods
    assert len(coarse.mesh.triangles) < 0.1 * len(fine.mesh.triangles)
    ends = np.array([fine.mesh.positions.min(axis=0), fine.mesh.positions.max(axis=0)])
    for view in VIEWS:
        one, other = (
            (draw(lod, view, ends=ends, size=CLOSE_PX) > 0).astype(float) for lod in (fine, coarse)
        )
        assert compare(one, other) >= 0.9


@pytest.mark.slow
def test_picture_shows_the_surface_lit_from_the_eye(lods: tuple[Lod, ...]) -> None:
    ends = np.array([lods[0].mesh.positions.min(axis=0), lods[0].mesh.positions.max(axis=0)])
    picture = draw(lods[0], VIEWS[0], ends=ends, size=64)
    assert picture.shape == (64, 64)
    assert 0 < (picture > 0).mean() < 1
    assert picture.max() <= 1
