"""The share of the source's voxels that a surface encloses, and the share that filters remove."""

import re
from pathlib import Path

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from scipy import ndimage
from skimage.measure import marching_cubes

from stereocell.building.out_folder import OutFolder
from stereocell.building.surface_cover import NO_REMEDY, REMEDY, SurfaceCover
from stereocell.cli.__main__ import main
from stereocell.isosurface.cover import measure_cover
from stereocell.isosurface.lifted_by_noise import Lifted, count_lifted
from stereocell.model.lattice import Lattice
from stereocell.model.lattice_field import LatticeField
from stereocell.model.tiling import Box
from stereocell.model.unit import Cover
from stereocell.report.facts import gather
from stereocell.report.remarks import find_remarks
from stereocell.steps.unit_files import cover_of, load_lods, load_record
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


def test_both_shares_follow_from_the_counts() -> None:
    cover = Cover(200, 150, 160) + Cover(0, 0, 0)
    assert cover.missing == pytest.approx(0.25)
    assert cover.added == pytest.approx(10 / 160)
    assert cover.words == (
        "the solid covers 75.0% of the source's voxels above the iso-value, and 6.2% of "
        "the solid lies below it"
    )
    assert (Cover(0, 0, 0).missing, Cover(0, 0, 0).added) == (0, 0)


@pytest.mark.parametrize("step", [(1, 1, 1), (2, 2, 2), (1, 3, 2)])
def test_the_voxels_on_the_tile_s_own_points_are_counted(step: tuple[int, int, int]) -> None:
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


def test_a_plate_between_two_planes_of_the_surface_counts_as_left_out() -> None:
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
def test_plan_report_and_check_state_that_a_surface_leaves_out_sheets(
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
    cover = cover_of(load_record(OutFolder(out).unit_dir(name, key)))
    above = _voxels() > LEVEL
    assert cover is not None
    assert cover.source == above.sum()
    sheets = above[:, :, 40:].sum()
    assert cover.missing == pytest.approx(
        sheets / above.sum(), abs=0.03
    )  # the rest is the ball's skin
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
    unit = OutFolder(out).unit_dir(name, key)
    cover = cover_of(load_record(unit))
    assert cover is not None
    assert cover.source == (voxels > level).sum()
    assert (
        cover.missing < 0.06
    )  # the rest is voxels at ends of lines, and specks that are fragments
    mesh = load_lods(unit)[0].mesh
    # compared with marching cubes of the unfiltered voxels, there is no extra ring
    theirs = marching_cubes(np.pad(voxels, 1, constant_values=int(GROUND)), level)
    assert _pieces(mesh.positions, mesh.triangles) <= _pieces(*theirs[:2])


def _pieces(positions: NDArray[np.float32], triangles: NDArray[np.integer]) -> int:
    return len(trimesh.Trimesh(positions, triangles).split(only_watertight=False))


def test_the_number_of_voxels_that_noise_lifts_is_estimated_well() -> None:
    rng = np.random.default_rng(0)
    denoised = rng.normal(200, 4, 400_000)
    level, noise = 221.0, 22.0
    is_lifted = (denoised + rng.normal(0, noise, denoised.shape) > level) & (denoised <= level)
    counts, edges = np.histogram(denoised, 500)
    found = count_lifted(counts, edges, level=level, noise=noise)
    is_far = denoised <= level - noise / 2
    assert found.far == pytest.approx((is_lifted & is_far).sum(), rel=0.02)
    assert found.far + found.near == pytest.approx(is_lifted.sum(), rel=0.02)
    assert count_lifted(counts, edges, level=level, noise=0.0) == Lifted(0.0, 0.0)


@pytest.mark.parametrize(
    ("lifted", "expected"),
    [
        (Lifted(0.0, 0.0), Cover(200, 100, 110)),
        (Lifted(60.0, 4.0), Cover(136, 100, 110)),
        (
            Lifted(60.0, 30.0),
            Cover(130, 100, 110),
        ),  # bounded by the voxels below the level in the solid
        (Lifted(500.0, 30.0), Cover(100, 100, 110)),  # bounded by the voxels that are left out
    ],
)
def test_voxels_that_noise_lifts_do_not_count_as_left_out(lifted: Lifted, expected: Cover) -> None:
    found = SurfaceCover.of(Cover(200, 100, 110), lifted)
    assert found.cover == expected
    assert found.lifted == 200 - expected.source
    assert found.words.startswith(expected.words)
    assert (f"noise alone lifts about {found.lifted} others" in found.words) == bool(found.lifted)


def test_the_remedy_is_advised_if_it_keeps_more_structure_than_noise() -> None:
    loss = Cover(200, 100, 110)
    assert SurfaceCover.of(loss, Lifted(20.0, 0.0)).remedy == REMEDY
    assert SurfaceCover.of(loss, Lifted(40.0, 0.0)).remedy == NO_REMEDY


def _cover_after(
    tmp_path: Path, voxels: NDArray[np.uint16], level: float, surface: str = ""
) -> tuple[Cover, NDArray[np.bool_]]:
    """Build the units of a volume, and return their cover and the voxels above the level."""
    (tmp_path / "own.toml").write_text(f"[surface]\n{surface}\n")
    scales = [{"z": 1.0, "y": 1.0, "x": 1.0}]
    source = phantoms.write_ome_zarr(tmp_path / "one.ome.zarr", [voxels], scales=scales)
    out, own = tmp_path / "out", str(tmp_path / "own.toml")
    flags = ["--iso-value", f"0={level:g}", "--config", own, "--grid", "1x1"]
    assert main(["plan", str(source), "-o", str(out), *flags]) == 0
    assert main(["units", str(out), "--workers", "0"]) == 0
    ((name, key),) = OutFolder(out).index().items()
    cover = cover_of(load_record(OutFolder(out).unit_dir(name, key)))
    assert cover is not None
    return cover, voxels > level


def test_noise_above_a_low_level_does_not_count_as_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The level lies one deviation of the noise above the background, like that of dim nuclei."""
    ball = phantoms.blurred_ball((32, 64, 64), (1.0, 1.0, 1.0), (15.5, 31.5, 31.5), 10.0, 1.5)
    noisy = 200 + 60 * ball + np.random.default_rng(0).normal(0, 22, ball.shape)
    cover, _ = _cover_after(tmp_path, noisy.round().astype(np.uint16), 222)
    assert cover.missing > 0.5
    assert "leaves out" not in capsys.readouterr().err


@pytest.mark.parametrize("noise", [20.0, 80.0])
def test_a_torn_shell_is_reported_beside_noise(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], noise: float
) -> None:
    """Smoothing may move a value by 20 deviations here, which removes a wall of two voxels."""
    body, level = ThinBody("sphere", 1.5, 1, 0), (GROUND + BODY) / 2
    noisy = body.voxels(noise).round().clip(0).astype(np.uint16)
    cover, above = _cover_after(tmp_path, noisy, level, f"max_shift = {2000 / noise:g}")
    printed = " ".join(capsys.readouterr().err.split())
    share = float(re.findall(r"leaves out (\d+)% of the source's", printed)[0]) / 100
    is_structure = above & (body.voxels() > level)
    lost = is_structure.sum() - cover.covered
    assert share == pytest.approx(lost / is_structure.sum(), abs=0.05)
    assert share > 0.1
    assert REMEDY in printed
