"""Thick slices across z, y or x give the same level, surface and bricks."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from stereocell.building.out_folder import OutFolder
from stereocell.building.survey_file import read_survey
from stereocell.filters.min_max_bricks import min_max_bricks
from stereocell.model.mesh import Lod
from stereocell.model.unit import Cover
from stereocell.steps.unit_files import cover_of, load_lods, load_record
from support import phantoms
from support.validators import make_assets

SHAPE, SPACING = (14, 64, 60), (4.0, 1.0, 1.0)  # (slice, row, column)


def _voxels() -> NDArray[np.uint16]:
    """Return a large and a small ball, in noise and in light that falls off across the slices."""
    field = phantoms.blurred_ball(SHAPE, SPACING, (28.0, 26.0, 30.0), 17.0, 1.5)
    field += phantoms.blurred_ball(SHAPE, SPACING, (28.0, 54.0, 30.0), 7.0, 1.5)
    counts = phantoms.as_counts(field, 200.0, 1200.0, noise=25.0).astype(np.float64)
    counts += np.linspace(0, 60, SHAPE[0])[:, None, None]
    return counts.round().astype(np.uint16)


class Built:
    """The only unit of a build."""

    def __init__(self, out: Path) -> None:
        folder = OutFolder(out)
        ((name, key),) = folder.index().items()
        directory = folder.unit_dir(name, key)
        self.lods: tuple[Lod, ...] = load_lods(directory)
        cover = cover_of(load_record(directory))
        assert cover is not None
        self.cover: Cover = cover
        (self.survey,) = read_survey(folder).values()


@pytest.fixture(scope="module")
def builds(tmp_path_factory: pytest.TempPathFactory) -> list[Built]:
    """Builds of the same voxels whose slices lie across z, y and x."""
    folder, found = tmp_path_factory.mktemp("turned"), []
    for axis in range(3):
        spacing = [1.0, 1.0, 1.0]
        spacing[axis] = SPACING[0]
        source = phantoms.write_ome_zarr(
            folder / f"{axis}.ome.zarr",
            [np.ascontiguousarray(np.moveaxis(_voxels(), 0, axis))],
            scales=[dict(zip("zyx", spacing, strict=True))],
        )
        out = folder / f"out_{axis}"
        assert make_assets(source, out, "1x1", "--workers", "0") == 0
        found.append(Built(out))
    return found


def _volume(lod: Lod) -> float:
    return abs(trimesh.Trimesh(lod.mesh.positions, lod.mesh.triangles).volume)


@pytest.mark.slow
def test_level_noise_and_cover_do_not_depend_on_the_slice_axis(builds: list[Built]) -> None:
    first, *others = builds
    assert first.survey.levels
    for other in others:
        for a, b in zip(first.survey.levels, other.survey.levels, strict=True):
            assert b.value == pytest.approx(a.value, rel=1e-3)
            assert b.confidence == pytest.approx(a.confidence, abs=0.01)
        levels = [one.survey.appearance.level for one in (first, other)]
        shifts = [level.max_shift for level in levels if level is not None]
        assert shifts[0] is not None
        assert shifts[1] == pytest.approx(shifts[0], rel=1e-3)
        assert other.cover.source == pytest.approx(first.cover.source, abs=2)
        assert other.cover.covered == pytest.approx(first.cover.covered, abs=2)


@pytest.mark.slow
def test_the_surface_and_its_levels_of_detail_do_not_depend_on_the_slice_axis(
    builds: list[Built],
) -> None:
    first, *others = builds
    for other in others:
        assert len(other.lods) == len(first.lods)
        for a, b in zip(first.lods, other.lods, strict=True):
            assert len(b.mesh.triangles) == pytest.approx(len(a.mesh.triangles), rel=0.15, abs=20)
            assert _volume(b) == pytest.approx(_volume(a), rel=0.005)


@pytest.mark.parametrize("axis", range(3))
def test_bricks_turn_with_the_volume(axis: int) -> None:
    voxels = (_voxels() // 8).astype(np.uint8)
    turned = min_max_bricks(np.ascontiguousarray(np.moveaxis(voxels, 0, axis)))
    np.testing.assert_array_equal(np.moveaxis(turned, axis, 0), min_max_bricks(voxels))
