"""How a surface covers the source's voxels above its level, beside what filters removed of them."""

import re
from pathlib import Path

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from scipy import ndimage
from skimage.measure import marching_cubes

from stereocell.building.out_folder import OutFolder
from stereocell.building.surface_cover import REMEDY
from stereocell.building.unit_files import cover_of, load_lods, load_record
from stereocell.cli.__main__ import main
from stereocell.isosurface.cover import measure_cover
from stereocell.model.lattice import Lattice
from stereocell.model.lattice_field import LatticeField
from stereocell.model.tiling import Box
from stereocell.model.unit import Cover
from stereocell.report.facts import gather
from stereocell.report.remarks import find_remarks
from support import phantoms
from support.thin_shells import BODY, GROUND, ThinBody
from support.validators import make_assets

SHAPE, LEVEL = (24, 48, 60), 500.0


def _voxels() -> NDArray[np.uint16]:
    """Return a thick ball, and sheets of one voxel that the median and the Gaussian remove."""
    ball = phantoms.blurred_ball(SHAPE, (1.0, 1.0, 1.0), (12.0, 24.0, 18.0), 9.0, 1.0)
    voxels = 100 + 900 * ball
    voxels[4:20, 8:40, 40:56:4] = 1000
    return voxels.round().astype(np.uint16)


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("cover") / "sheets.ome.zarr"
    scales = [{"z": 1.0, "y": 1.0, "x": 1.0}]
    return phantoms.write_ome_zarr(place, [_voxels()], scales=scales)


def test_shares_are_those_of_both_counts() -> None:
    cover = Cover(200, 150, 160) + Cover(0, 0, 0)
    assert cover.missing == pytest.approx(0.25)
    assert cover.added == pytest.approx(10 / 160)
    assert cover.words == (
        "the solid covers 75.0% of the source's voxels above the level, and 6.2% of the solid lies "
        "below it"
    )
    assert (Cover(0, 0, 0).missing, Cover(0, 0, 0).added) == (0, 0)


@pytest.mark.parametrize("step", [(1, 1, 1), (2, 2, 2), (1, 3, 2)])
def test_all_voxels_are_counted_on_the_tile_s_own_points(step: tuple[int, int, int]) -> None:
    """SciPy interpolates the solid between the planes that carry it."""
    rng = np.random.default_rng(0)
    voxels = rng.integers(0, 1000, (20, 24, 28)).astype(np.uint16)
    window, own = Box((2, 4, 6), (18, 24, 28)), Box((4, 8, 12), (15, 19, 23))
    region = Box((0, 0, 0), voxels.shape)
    lattice = Lattice(window, own, region, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0))
    field = (ndimage.gaussian_filter(voxels.astype(float), 1) - 500).astype(np.float32)
    distance = field[window.slices][lattice.slices_of_thinned(step)]
    iso = LatticeField(((0.0,), (0.0,), (0.0,)), np.full((1, 1, 1), 400.0))
    under = LatticeField(((0.0,), (0.0,), (0.0,)), np.full((1, 1, 1), 100.0))
    found = measure_cover(
        voxels[window.slices], distance, lattice, step, iso=iso, background=under, holder=None
    )
    places = np.mgrid[own.slices] / np.reshape(step, (3, 1, 1, 1))
    planes = field[:: step[0], :: step[1], :: step[2]].astype(np.float64)
    solid = ndimage.map_coordinates(planes, places, order=1, mode="nearest") > 0
    above = (voxels > 500)[own.slices]
    assert found == Cover(int(above.sum()), int((above & solid).sum()), int(solid.sum()))


def test_a_plate_between_two_planes_of_the_surface_counts_as_lost() -> None:
    voxels = np.zeros((9, 9, 10), np.uint16)
    voxels[3, 2:7, 2:7] = 1000
    voxels[2:7, 2:7, 9] = 1000  # beyond the last plane
    lattice = Lattice.of_whole(Box((0, 0, 0), voxels.shape), (1.0, 1.0, 1.0))
    level = LatticeField(((0.0,), (0.0,), (0.0,)), np.full((1, 1, 1), 500.0))
    distance = (voxels.astype(np.float32) - 500)[::2, ::2, ::2]
    found = measure_cover(
        voxels, distance, lattice, (2, 2, 2), iso=level, background=None, holder=None
    )
    assert found == Cover(50, 0, 0)


@pytest.mark.slow
def test_a_surface_that_loses_sheets_says_so_everywhere(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, unbounded = tmp_path / "out", tmp_path / "unbounded.toml"
    unbounded.write_text("[surface]\nmax_shift = 0.0\n")
    level = ("--iso-value", f"Channel0={LEVEL:g}", "--config", str(unbounded))
    assert make_assets(source, out, "1x1", "--workers", "0", plan=level) == 0
    units = capsys.readouterr().err
    assert main(["check", str(out), "--deep", "--workers", "0"]) == 0
    deep = capsys.readouterr().out
    index = OutFolder(out).index()
    ((name, key),) = index.items()
    cover = cover_of(load_record(OutFolder(out).unit_dir(*name.split("/"), key)))
    above = _voxels() > LEVEL
    assert cover is not None
    assert cover.source == above.sum()
    sheets = above[:, :, 40:].sum()
    assert cover.missing == pytest.approx(sheets / above.sum(), abs=0.03)  # and the ball's skin
    assert f"its surface leaves out {cover.missing:.0%} of the source's voxels" in units
    assert REMEDY in " ".join(units.split())
    assert cover.words in deep
    titles = {remark.title: remark.lines for remark in find_remarks(gather(OutFolder(out)))}
    (lines,) = (lines for title, lines in titles.items() if "leaves out more than 5%" in title)
    assert cover.words in lines[0]


@pytest.mark.slow
def test_the_remedy_that_the_note_names_keeps_thin_sheets_and_specks(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = re.findall(r"[a-z_]+ = [0-9.]+", REMEDY)
    remedy = tmp_path / "remedy.toml"
    remedy.write_text("\n".join(["[surface]", *settings]))
    assert len(settings) == 3
    level = ("--iso-value", f"Channel0={LEVEL:g}", "--config", str(remedy))
    assert main(["plan", str(source), "-o", str(tmp_path / "out"), "--grid", "1x1", *level]) == 0
    assert main(["units", str(tmp_path / "out"), "--workers", "0"]) == 0
    assert "leaves out" not in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("slice_axis", range(3))
def test_the_built_surface_of_a_thin_dome_is_whole(tmp_path: Path, slice_axis: int) -> None:
    """A shell of two voxels, in slices four times as far apart as their pixels."""
    body = ThinBody("sphere", 2, 4, slice_axis)
    voxels = body.voxels().round().astype(np.uint16)
    scales = [dict(zip("zyx", body.spacing, strict=True))]
    source = phantoms.write_ome_zarr(tmp_path / "dome.ome.zarr", [voxels], scales=scales)
    level = (GROUND + BODY) / 2
    out = tmp_path / "out"
    settings = ("--iso-value", f"Channel0={level:g}")
    assert make_assets(source, out, "1x1", "--workers", "0", plan=settings) == 0
    index = OutFolder(out).index()
    ((name, key),) = index.items()
    unit = OutFolder(out).unit_dir(*name.split("/"), key)
    cover = cover_of(load_record(unit))
    assert cover is not None
    assert cover.source == (voxels > level).sum()
    assert cover.missing < 0.06  # voxels at ends of lines, and specks that are fragments
    mesh = load_lods(unit)[0].mesh
    # marching cubes of the voxels as they are: no ring by itself that is not there
    theirs = marching_cubes(np.pad(voxels, 1, constant_values=int(GROUND)), level)
    assert _pieces(mesh.positions, mesh.triangles) <= _pieces(*theirs[:2])


def _pieces(positions: NDArray[np.float32], triangles: NDArray[np.integer]) -> int:
    return len(trimesh.Trimesh(positions, triangles).split(only_watertight=False))
