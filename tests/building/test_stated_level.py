"""The level that a build states: one for each channel, enough to find the surface again."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pxr import Usd
from scipy import ndimage
from skimage.measure import marching_cubes

from stereocell.building.out_folder import OutFolder
from stereocell.cli.__main__ import main
from stereocell.report.facts import gather
from stereocell.report.remarks import find_remarks
from stereocell.steps.unit_files import load_lods
from support import phantoms
from support.exhaustive import sweep
from support.validators import make_assets

SPACING = (2.0, 1.0, 1.0)
SHAPE = (20, 64, 96)
NAMES = ("uneven", "noise", "flat", "even", "dim")
CONFIDENCES = {"uneven": "clear", "even": "clear", "dim": "unsure", "noise": "none", "flat": "none"}
BEGINNINGS = {"clear": "", "unsure": "unsure surface: at ", "none": "no clear surface: "}
SETTINGS = """
[surface]
alpha_um = 0.0
max_fragment_um = 0.0
min_diagonal_um = 4.0
max_cavity_um = 0.0
"""


def _voxels() -> NDArray[np.uint16]:
    """Return five channels: balls on a rising background, noise, one value, even and dim balls."""
    rng = np.random.default_rng(0)
    field = np.zeros(SHAPE, np.float32)
    for y in (16.0, 46.0):
        for x in (14.0, 46.0, 80.0):
            field += phantoms.blurred_ball(SHAPE, SPACING, (19.0, y, x), 8.0, 1.0)
    rise = 200 + 400 * np.arange(SHAPE[2]) / SHAPE[2]
    noise = ndimage.gaussian_filter(rng.normal(size=SHAPE), 1.0)
    return np.stack(
        [
            (rise + 300 * field + rng.normal(0, 6, SHAPE)).round().astype(np.uint16),
            np.rint(1000 + 200 * noise / noise.std()).astype(np.uint16),
            np.full(SHAPE, 7, np.uint16),
            phantoms.as_counts(field, 100, 1100, noise=10.0),
            phantoms.as_counts(field, 200, 250, noise=40.0),
        ]
    )


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return phantoms.write_ome_zarr(
        tmp_path_factory.mktemp("stated") / "five.ome.zarr",
        [_voxels()],
        "czyx",
        scales=[{"c": 1.0, **dict(zip("zyx", SPACING, strict=True))}],
        channels=[{"label": name, "color": "FFFFFF"} for name in NAMES],
    )


@pytest.fixture(scope="module")
def out(source: Path) -> Path:
    settings = source.parent / "settings.toml"
    settings.write_text(SETTINGS)
    out = source.parent / "out"
    flags = ("--config", str(settings))
    assert make_assets(source, out, "2x1", "--workers", "0", plan=flags) == 0
    return out


def _stated(out: Path, channel: str) -> dict[str, Any]:
    """Return the file that the stage names, found in the way of another program."""
    stage = Usd.Stage.Open(str(out / "stage" / "stage.usda"))
    prim = stage.GetPrimAtPath(f"/Specimen/Channels/{channel}")
    name = prim.GetAttribute("stereocell:levelFile").Get()
    content: dict[str, Any] = json.loads((out / "stage" / "looks" / name).read_text("utf-8"))
    assert content["iso"] == pytest.approx(prim.GetAttribute("stereocell:levelIso").Get())
    return content


def _bounded(
    field: NDArray[np.float64], voxels: NDArray[np.uint16], denoising: dict[str, Any]
) -> NDArray[np.float64]:
    """Return the smoothed field, limited to the largest shift that the file states."""
    others = np.ones(denoising["hot_voxel_box"], bool)
    in_plane = [n > 1 for n in denoising["median_voxels"]]
    straight = [1 if is_in else slice(None) for is_in in in_plane]
    others[tuple(straight)] = False
    low = ndimage.minimum_filter(voxels, footprint=others, mode="mirror")
    high = ndimage.maximum_filter(voxels, footprint=others, mode="mirror")
    measured = np.clip(voxels, low, high).astype(np.float64)
    return np.clip(field, measured - denoising["max_shift"], measured + denoising["max_shift"])


def _again(voxels: NDArray[np.uint16], stated: dict[str, Any]) -> NDArray[np.float64]:
    """Return the denoised voxels above the level, computed by scipy from the file's values."""
    denoising = stated["denoising"]
    field = ndimage.median_filter(voxels, denoising["median_voxels"], mode="nearest")
    sigma = denoising["gaussian_sigma_um"] / np.array(SPACING)
    truncate = denoising["gaussian_truncate"]
    field = ndimage.gaussian_filter(
        field.astype(np.float64), sigma, mode="nearest", truncate=truncate
    )
    field = _bounded(field, voxels, denoising)
    if stated["background"] is not None:
        values = np.array(stated["background"]["values"])
        for axis, centres in enumerate(stated["background"]["centres"]):
            at = np.interp(np.arange(SHAPE[axis]), centres, np.arange(len(centres)))
            low = np.minimum(at.astype(int), max(len(centres) - 2, 0))
            high = np.minimum(low + 1, len(centres) - 1)
            share = (at - low).reshape([-1 if k == axis else 1 for k in range(3)])
            values = np.take(values, low, axis) * (1 - share) + np.take(values, high, axis) * share
        field -= values
    return field - stated["iso"]


@pytest.mark.slow
@pytest.mark.parametrize("channel", ["uneven", "even"])
def test_scikit_image_finds_the_surface_where_the_stage_says(out: Path, channel: str) -> None:
    stated = _stated(out, channel)
    assert (stated["background"] is None) == (channel == "even")
    above = _again(_voxels()[NAMES.index(channel)], stated)
    theirs = marching_cubes(np.pad(above, 1, constant_values=-1e3), 0.0)[0] - 1  # voxels (z, y, x)
    theirs = theirs[((theirs > 1) & (theirs < np.array(SHAPE) - 2)).all(axis=1)]
    folder = OutFolder(out)
    ours = np.concatenate(
        [
            load_lods(folder.unit_dir(unit, key))[0].mesh.positions
            for unit, key in folder.index().items()
            if unit.endswith(f"/{channel}") and load_lods(folder.unit_dir(unit, key))
        ]
    ).astype(np.float64)
    ours = np.stack([ours[:, 2], -ours[:, 1], ours[:, 0]], axis=1) / SPACING
    ours = ours[((ours > 1) & (ours < np.array(SHAPE) - 2)).all(axis=1)]
    # the field at StereoCell's vertices over its slope: their distance from the level, in voxels
    slopes = np.gradient(above)
    value, *slope = (ndimage.map_coordinates(one, ours.T, order=1) for one in (above, *slopes))
    away = np.abs(value) / np.linalg.norm(slope, axis=0)
    assert len(ours) > 500
    assert np.percentile(away, 95) < 0.1
    # each vertex of scikit-image has one of StereoCell's nearby, so nothing is missing
    from scipy.spatial import cKDTree

    assert cKDTree(ours).query(theirs)[0].max() < 3


@pytest.mark.slow
def test_stage_manifest_and_report_state_the_same_for_each_channel(out: Path) -> None:
    stage = Usd.Stage.Open(str(out / "stage" / "stage.usda"))
    manifest = json.loads((out / "bundle" / "manifest.json").read_text("utf-8"))
    remarks = {r.title: r.lines for r in find_remarks(gather(OutFolder(out)))}
    reasons: dict[str, list[str]] = {}
    for channel in manifest["channels"]:
        prim = stage.GetPrimAtPath(f"/Specimen/Channels/{channel['id']}")
        confidence = CONFIDENCES[channel["name"]]
        has_surface = confidence != "none"
        assert channel["surface"] == confidence
        assert prim.GetAttribute("stereocell:surfaceVerdict").Get() == channel["surface"]
        assert (channel["tileset"] is None) == (not has_surface)
        assert (channel["level"] is None) == (not has_surface)
        assert channel["volumes"]  # the channel is visible as a volume
        reason = prim.GetAttribute("stereocell:surfaceReason").Get() or ""
        assert channel["surface_reason"] == reason
        assert reason.startswith(BEGINNINGS[confidence])
        assert bool(reason) == (confidence != "clear")
        reasons.setdefault(confidence, []).append(f"{channel['name']}: {reason}")
    assert remarks["2 channels without a surface"] == tuple(reasons["none"])
    assert remarks["1 channel with an unsure surface"] == tuple(reasons["unsure"])
    uneven = next(c for c in manifest["channels"] if c["name"] == "uneven")
    low, high = uneven["level"]["background"]
    assert 150 < low < 300 < 450 < high < 650
    assert 100 < uneven["level"]["iso"] < 200


def test_all_tiles_state_the_channel_s_level_unless_it_has_no_surface(out: Path) -> None:
    for name, channel in OutFolder(out).survey().items():
        values = {tile["value"] for tile in channel["iso"].values()}
        assert len(values) == 1, name
        assert (values == {None}) == (name in ("noise", "flat"))


@pytest.mark.slow
def test_giving_the_found_value_above_the_background_gives_the_same_surfaces(
    source: Path, out: Path, tmp_path: Path
) -> None:
    iso = _stated(out, "uneven")["iso"]
    settings = str(source.parent / "settings.toml")
    flags = ["--grid", "2x1", "--channels", "uneven", "--config", settings]
    given = [*flags, "--iso-value", f"uneven={iso!r}+b"]
    assert main(["plan", str(source), "-o", str(tmp_path / "out"), *given]) == 0
    assert main(["units", str(tmp_path / "out"), "--workers", "0"]) == 0
    found = OutFolder(tmp_path / "out").index()
    ours = {unit: key for unit, key in OutFolder(out).index().items() if unit.endswith("/uneven")}
    assert found == ours  # the same keys mean the same surfaces


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(
    ("given", "side"), sweep([("5000", "below"), ("-3", "above")], kept=[("5000", "below")])
)
def test_a_given_level_with_all_voxels_on_one_side_has_no_surface_and_a_reason(
    source: Path, tmp_path: Path, given: str, side: str
) -> None:
    flags = ["--grid", "2x1", "--channels", "even", f"--iso-value=even={given}"]
    assert main(["build", str(source), "-o", str(tmp_path / "out"), *flags, "--workers", "0"]) == 0
    (channel,) = json.loads((tmp_path / "out" / "bundle" / "manifest.json").read_text("utf-8"))[
        "channels"
    ]
    assert channel["surface"] == "none"
    assert channel["surface_reason"] == f"no surface: all voxels lie {side} the iso-value {given}"
    assert channel["tileset"] is None


@pytest.mark.slow
@pytest.mark.parametrize("values", [(0, 1), (0, 255), (3, 900)])
@pytest.mark.parametrize("scope", ["channel", "tile"])
def test_the_surface_of_a_mask_lies_half_way_and_a_ball_keeps_its_size(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], values: tuple[int, int], scope: str
) -> None:
    away = np.linalg.norm(
        np.indices(SHAPE, np.float64).T * SPACING - np.array((20.0, 32.0, 40.0)), axis=-1
    ).T
    mask = np.where(away < 17.0, values[1], values[0]).astype(np.uint16)
    path = phantoms.write_ome_zarr(
        tmp_path / "mask.ome.zarr", [mask[None]], "czyx",
        scales=[{"c": 1.0, **dict(zip("zyx", SPACING, strict=True))}],
    )  # fmt: skip
    out = tmp_path / "out"
    assert main(["plan", str(path), "-o", str(out), "--grid", "2x1", "--iso-scope", scope]) == 0
    assert main(["units", str(out), "--workers", "0"]) == 0
    note = f"a mask of {values[0]} and {values[1]}, whose surface lies half-way"
    assert note in capsys.readouterr().err
    (channel,) = OutFolder(out).survey().values()
    assert {tile["value"] for tile in channel["iso"].values()} == {sum(values) / 2}
    assert channel["appearance"]["surface"] == "clear"
    volume = 0.0
    for unit, key in OutFolder(out).index().items():
        mesh = load_lods(OutFolder(out).unit_dir(unit, key))[0].mesh
        a, b, c = (mesh.positions[mesh.triangles[:, k]].astype(np.float64) for k in range(3))
        volume += float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum()) / 6
    assert volume == pytest.approx(4 / 3 * np.pi * 17.0**3, rel=0.03)


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_a_mask_of_single_voxels_has_no_surface_and_a_note_says_why(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mask = np.zeros(SHAPE, np.uint8)
    mask[5:15:4, 8:60:9, 8:90:9] = 255
    path = tmp_path / "specks.ome.tif"
    phantoms.write_ome_tiff(path, mask, spacing=SPACING)
    out = tmp_path / "out"
    assert main(["build", str(path), "-o", str(out), "--workers", "0"]) == 0
    output = capsys.readouterr().err
    assert (
        "half-way; 0% of it is left after a median of 3 x 3 voxels and a Gaussian of 1 um" in output
    )
    assert "no surface: all voxels lie below the iso-value 127.5" in output
    (channel,) = json.loads((out / "bundle" / "manifest.json").read_text("utf-8"))["channels"]
    assert channel["surface"] == "none"


@pytest.mark.slow
@pytest.mark.parametrize("flag", ["--iso-value=even=500+b", "--surfaces=even=500+b"])
def test_a_note_says_that_a_level_without_background_counts_from_0(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], flag: str
) -> None:
    (tmp_path / "s.toml").write_text(f"{SETTINGS}background_um = 0.0\n")
    flags = ["--channels", "even", "--config", str(tmp_path / "s.toml"), flag]
    assert main(["plan", str(source), "-o", str(tmp_path / "out"), *flags]) == 0
    assert main(["units", str(tmp_path / "out"), "--workers", "0"]) == 0
    note = "units: even: found no background to subtract: its iso-value counts from 0"
    assert note in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_each_requested_surface_is_a_channel_of_its_own(source: Path, tmp_path: Path) -> None:
    flags = ["-o", str(tmp_path / "out"), "--workers", "0", "--channels", "even"]
    surfaces = ["--surfaces", "even=outer,800"]
    assert main(["build", str(source), *flags, *surfaces]) == 0
    manifest = json.loads((tmp_path / "out" / "bundle" / "manifest.json").read_text("utf-8"))
    outer, inner = manifest["channels"]
    assert (outer["name"], inner["name"]) == ("even outer", "even 800")
    assert outer["level"]["iso"] < inner["level"]["iso"] == 800
    assert outer["triangles"][0] > 0 < inner["triangles"][0]
    assert outer["color"] != inner["color"]
    # the voxels are shown once; the second channel is only a surface in the first one's volume
    shown = [
        json.loads((tmp_path / "out" / "bundle" / channel["volumes"]["path"]).read_text("utf-8"))
        for channel in (outer, inner)
    ]
    assert [len(one["volumes"]) for one in shown] == [1, 0]
    assert main(["check", str(tmp_path / "out"), "--deep", "--workers", "0"]) == 0
    # the voxels are read and counted once for both
    windows = list((tmp_path / "out" / "units").glob("window-*.json"))
    assert len(windows) <= 2


@pytest.mark.parametrize(
    ("surfaces", "message"),
    [
        ("even=outer,outer", "--surfaces even: found outer,outer, expected each once"),
        ("even=skin", "--surfaces even: found 'skin', expected outer, inner, third, voxel"),
        ("odd=outer", "--surfaces names channel 'odd', expected one of uneven"),
        ("even=outer,,inner", "--surfaces even: found '', expected outer, inner, third, voxel"),
        ("even=", "--surfaces is 'even=', expected CHANNEL=SURFACE,..."),
    ],
)
def test_an_unknown_surface_is_refused_in_one_line(
    source: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    surfaces: str,
    message: str,
) -> None:
    flags = ["-o", str(tmp_path / "out"), "--surfaces", surfaces]
    assert main(["plan", str(source), *flags]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("flags", "note"),
    [
        (
            ["--surfaces", "even=inner", "--iso-value", "even=700"],
            "even: --surfaces chooses the iso-value, so 700",
        ),
        (
            ["--surfaces", "3=outer,800", "--iso-criterion", "adaptive"],
            "even 800: --surfaces chooses the iso-value, so --iso-criterion adaptive is ignored",
        ),
        (
            ["--iso-value", "3=700", "--iso-scope", "tile"],
            "even: the settings state its iso-value, so all tiles have the same one, and",
        ),
    ],
)
def test_a_note_names_a_setting_that_another_one_overrules(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], flags: list[str], note: str
) -> None:
    flags = ["-o", str(tmp_path / "out"), "--channels", "even", *flags]
    assert main(["plan", str(source), *flags]) == 0
    assert f"plan: {note}" in capsys.readouterr().err


@pytest.mark.slow
def test_surfaces_by_name_are_found_levels_whatever_the_criterion_is(
    source: Path, tmp_path: Path
) -> None:
    flags = ["--channels", "even", "--surfaces", "even=outer", "--workers", "0"]
    levels = []
    for criterion in ("levels", "adaptive", "edges"):
        out = tmp_path / criterion
        plain = ["-o", str(out), *flags[:4], "--iso-criterion", criterion]
        assert main(["plan", str(source), *plain]) == 0
        assert main(["units", str(out), *flags[4:]]) == 0
        levels.append(OutFolder(out).survey()["even"]["appearance"]["level"]["iso"])
    assert levels[0] == levels[1] == levels[2]


def test_a_named_window_of_ct_is_refused_for_other_volumes(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    flags = ["-o", str(tmp_path / "out"), "--window", "even=brain"]
    assert main(["plan", str(source), *flags]) == 2
    error = capsys.readouterr().err
    assert "--window even=brain: this window is in Hounsfield units, and the input is not" in error
    assert error.count("\n") == 1


def test_a_window_given_twice_is_refused(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    flags = ["-o", str(tmp_path / "out"), "--window", "even=1:2", "--window", "3=3:4"]
    assert main(["plan", str(source), *flags]) == 2
    assert "--window names channel 'even' twice, expected once" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_tiles_with_their_own_levels_state_them_as_a_field(source: Path, tmp_path: Path) -> None:
    copy = tmp_path / "it's a copy.ome.zarr"
    shutil.copytree(source, copy)
    flags = ["-o", str(tmp_path / "out"), "--channels", "even", "--grid", "3x1", "--workers", "0"]
    assert main(["build", str(copy), *flags, "--iso-scope", "tile"]) == 0
    stated = _stated(tmp_path / "out", "even")
    values = np.array(stated["iso_by_tile"]["values"]).ravel()
    assert len(values) == 3
    assert np.ptp(values) > 0
    assert values.mean() == pytest.approx(stated["iso"])
