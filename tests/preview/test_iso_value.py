"""`stereocell iso`: a picture and a table of one tile's candidates, and no other file."""

import shlex
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from stereocell.building.out_folder import OutFolder
from stereocell.cli.__main__ import main
from stereocell.planning.settings import load
from stereocell.preview import iso_value
from stereocell.preview.iso_value import COLORS, Candidate, preview, table
from support import phantoms
from support.exhaustive import sweep

SPACING = (1.0, 1.0, 1.0)
CONSTANT = 100
LOW, HEIGHT = 100, 1000  # voxel values: the background, and how far the ball rises above it
RADIUS_UM, BLUR_UM = 8.0, np.sqrt(2)  # sigmas of the ball's own blur and of smoothing are 1 um each
SLICES_AT = (14 + 14 + 21, 14)  # pixels from the top (margin, title, margin) and from the left
SCALE = 900 / 32  # pixels a um, in slices


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A ball (1000) on a background (100) in channel 0's left tile; channel 1 is constant."""
    ball = phantoms.blurred_ball((24, 32, 64), SPACING, (12.0, 16.0, 16.0), 8.0, 1.0)
    counts = phantoms.as_counts(ball, 100, 1100, noise=10.0)
    channels = np.stack([counts, np.full_like(counts, CONSTANT)])
    path = tmp_path_factory.mktemp("preview") / "ball.ome.zarr"
    scales = [{"c": 1.0, **dict.fromkeys("zyx", 1.0)}]
    return phantoms.write_ome_zarr(path, [channels], "czyx", scales=scales)


@pytest.fixture
def small_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make small pictures, for tests that don't look at them; one of full size takes a second."""
    monkeypatch.setattr(iso_value, "_LONGEST_PX", 90)


def _iso(source: Path, *flags: str) -> int:
    return main(["iso", str(source), "--tile-size", "24,32,32", *flags])


@pytest.mark.slow
@pytest.mark.usefixtures("small_picture")
def test_the_table_lists_iso_values_with_shares_and_the_flags_that_choose_them(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "ball.png"
    assert _iso(source, "--channel", "0", "--tile", "r0_c0", "-o", str(out)) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert rows[0][0] == "candidate"
    assert rows[1][:2] == ["outer", "*"]
    assert " ".join(rows[-2]) == "* a build uses this one; found on all tiles"
    assert rows[-1] == ["wrote", str(out)]
    _, _, level, raw, inside, confidence = rows[1]
    ball = 4 / 3 * np.pi * 8**3 / (24 * 32 * 32)
    # a ball blurred by s has .5 - s / (R sqrt(2 pi)) of its height at R; the smoothing adds 1 um
    height = 0.5 - BLUR_UM / (RADIUS_UM * np.sqrt(2 * np.pi))
    assert float(level) == float(raw)  # no background is subtracted where the ground is even
    assert float(level) == pytest.approx(LOW + HEIGHT * height, rel=0.1)
    assert float(inside.rstrip("%")) / 100 == pytest.approx(ball, rel=0.1)
    assert float(confidence) > 0.8
    flags = [word for row in rows[2:-2] for word in row if word.startswith("--")]
    assert len(flags) == 3
    assert set(flags) <= {"--surfaces", "--iso-value"}


@pytest.mark.slow
@pytest.mark.usefixtures("small_picture")
@pytest.mark.parametrize(
    "flags",
    sweep(
        [
            "",
            "--iso-scope tile",
            "--iso-criterion edges",
            "--surfaces 0=outer",
            "--surfaces 0=300+b",
            "--iso-value 0=300+b",
        ],
        kept=["", "--iso-scope tile", "--surfaces 0=300+b"],
    ),
)
def test_the_setting_in_a_row_of_the_table_chooses_the_level_of_that_row(
    source: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    flags: str,
) -> None:
    """The row's setting is added to the given ones, or replaces the one that chose the level."""
    given = flags.split()
    where = ("--channel", "0", "--tile", "r0_c0", "-o", str(tmp_path / "ball.png"))
    assert _iso(source, *where, *given) == 0
    rows = capsys.readouterr().out.splitlines()[2:-2]
    assert len(rows) >= 2
    for row in rows:
        _, _, setting = row.partition("--")
        flag, value = shlex.split(f"--{setting}")
        words = [word.removesuffix("+b") for word in row.split()]
        level = next(float(word) for word in words if word.replace(".", "").isdigit())
        kept = [] if given[:1] in ([flag], ["--iso-value"]) else given
        assert _iso(source, *where, *kept, flag, value) == 0
        taken = next(line for line in capsys.readouterr().out.splitlines() if " * " in line)
        found = taken.split("*")[1].split()[0]
        assert float(found.removesuffix("+b")) == pytest.approx(level, rel=1e-3), row
        assert found.endswith("+b") == any(word.endswith("+b") for word in row.split()[:4]), row


@pytest.mark.usefixtures("small_picture")
def test_a_setting_leaves_the_channel_s_other_surfaces_as_they_are(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    flags = ("--surfaces", "0=outer,700", "--tile", "r0_c0", "-o", str(tmp_path / "ball.png"))
    assert _iso(source, "--channel", "Channel0 700", *flags) == 0
    rows = capsys.readouterr().out.splitlines()[2:-2]
    settings = [shlex.split(row[row.index("--") :])[1] for row in rows]
    assert all(setting.partition("=")[2].startswith("outer,") for setting in settings)
    assert not any(setting.endswith("outer,outer") for setting in settings)


@pytest.mark.slow
def test_the_legend_has_every_candidate_s_colour_and_nothing_else_is_written(
    source: Path, tmp_path: Path
) -> None:
    out = tmp_path / "ball.png"
    assert _iso(source, "--channel", "0", "--tile", "r0_c0", "-o", str(out)) == 0
    assert list(tmp_path.iterdir()) == [out]
    legend = np.asarray(Image.open(out))[SLICES_AT[0] + round((32 + 24) * SCALE) :]
    assert set(COLORS[:4]) <= {tuple(p) for p in legend.reshape(-1, 3).tolist()}


def _radius_um(candidate: Candidate) -> float:
    """Return the radius, um, at which the blurred ball has the candidate's level."""
    along = phantoms.blurred_ball((1, 1, 1500), (1, 1, 0.01), (0, 0, 0), RADIUS_UM, float(BLUR_UM))
    return 0.01 * int(np.abs(along[0, 0] - (candidate.raw - LOW) / HEIGHT).argmin())


@pytest.mark.slow
def test_contours_in_the_slices_lie_where_the_ball_has_their_levels(
    source: Path, tmp_path: Path
) -> None:
    """Each candidate's line is a circle, whole, in its own colour, and at its own radius."""
    # Without a bound on the shift of a value, the Gaussian acts in full, as BLUR_UM assumes.
    flags = {"plan": {"tile_size": [24, 32, 32]}, "surface": {"max_shift": 0.0}}
    settings = load(None, None, flags=flags)
    result, path = preview(
        str(source), "0", tile_id="r0_c0", out=tmp_path / "a.png", settings=settings
    )
    top, left = SLICES_AT
    xy = np.asarray(Image.open(path))[top : top + 900, left : left + 900]
    colors = {c.name: color for c, color in zip(result.candidates, COLORS, strict=False)}
    outlining = [c for c in result.candidates if 0.01 < c.inside < 0.5]
    assert len(outlining) > 1
    radii = {c.name: _radius_um(c) for c in outlining}
    assert np.ptp(list(radii.values())) > 0.5
    for name, radius in radii.items():
        rows, columns = np.nonzero((xy == colors[name]).all(axis=-1))
        down, right = (pixels + 0.5 - 16.5 * SCALE for pixels in (rows, columns))
        away = np.hypot(down, right)
        # One of the lines is white. Text, scale bar and brightest voxels are white, too.
        beside = (away > 4 * SCALE) & (away < 11 * SCALE)
        assert beside.any(), name
        assert np.abs(away[beside] - radius * SCALE).max() < 8, name
        assert away[beside].mean() == pytest.approx(radius * SCALE, abs=4), name
        sectors = np.floor(np.arctan2(down, right)[beside] / (2 * np.pi) * 36)
        assert len(np.unique(sectors)) == 36, name


@pytest.mark.usefixtures("small_picture")
def test_a_value_that_is_given_is_the_chosen_one_in_voxels_as_they_are(
    source: Path, tmp_path: Path
) -> None:
    flags = {"plan": {"tile_size": [24, 32, 32]}, "iso_values": {"0": 600.0}}
    result, _ = preview(
        str(source),
        "0",
        tile_id="r0_c0",
        out=tmp_path / "a.png",
        settings=load(None, None, flags=flags),
    )
    chosen, *others = result.candidates
    assert (chosen.name, chosen.level, chosen.raw) == ("given", 600, 600)
    assert chosen.is_chosen
    assert chosen.confidence is None  # a level that is given is no guess, as the report has it
    assert not result.unsure
    assert others
    assert all(one.setting and not one.is_chosen for one in others)
    assert table(result)[-1] == "* a build uses this one; given, and others found on all tiles"


@pytest.mark.slow
@pytest.mark.usefixtures("small_picture")
def test_a_level_for_each_tile_is_the_build_s(tmp_path: Path) -> None:
    balls = [
        height * phantoms.blurred_ball((24, 32, 64), SPACING, (12.0, 16.0, x), 8.0, 1.0)
        for height, x in ((0.6, 16.0), (1.0, 48.0))
    ]
    counts = phantoms.as_counts(balls[0] + balls[1], 100, 1100, noise=10.0)
    source = tmp_path / "two.ome.tif"
    phantoms.write_ome_tiff(source, counts, spacing=SPACING)
    flags = ["--tile-size", "24,32,32", "--iso-scope", "tile"]
    out = tmp_path / "out"
    assert main(["plan", str(source), "-o", str(out), *flags]) == 0
    assert main(["units", str(out), "--workers", "0"]) == 0
    (survey,) = OutFolder(out).survey().values()
    settings = {"plan": {"tile_size": [24, 32, 32]}, "isovalue": {"scope": "tile"}}
    levels = []
    for tile, built in survey["iso"].items():
        result, _ = preview(
            str(source),
            "0",
            tile_id=tile,
            out=tmp_path / "a.png",
            settings=load(None, None, flags=settings),
        )
        assert result.candidates[0].level == built["value"]
        levels.append(built["value"])
    assert levels[0] < 0.9 * levels[1]


@pytest.mark.exhaustive
def test_same_input_same_bytes(source: Path, tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        flags = ("--channel", "0", "--tile", "r0_c0", "-o", str(tmp_path / name))
        assert _iso(source, *flags) == 0
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


@pytest.mark.usefixtures("small_picture")
def test_the_picture_is_named_after_channel_and_tile_by_default(
    source: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert _iso(source, "--channel", "0", "--tile", "r0_c0") == 0
    (picture,) = tmp_path.iterdir()
    assert picture.name.startswith("iso_")
    assert picture.name.endswith("_r0_c0.png")


@pytest.mark.parametrize(
    ("flags", "code", "message"),
    [
        (("--channel", "CD31", "--tile", "r0_c0"), 2, "--channel is 'CD31', expected one of "),
        (
            ("--channel", "0", "--tile", "r1_c0"),
            2,
            "--tile is 'r1_c0', expected a tile from r0_c0 to r0_c1",
        ),
        (
            ("--channel", "1", "--tile", "r0_c0"),
            1,
            "all voxels are nearly equal, so there is no surface",
        ),
        (("--channel", "0", "--tile", "r0_c0", "-o", "a.jpg"), 2, "-o is 'a.jpg', expected a file"),
    ],
)
def test_errors_are_one_clear_line(
    source: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    flags: tuple[str, ...],
    code: int,
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert _iso(source, *flags) == code
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def write_png_that_states_a_huge_size(path: Path) -> bytes:
    """Write a PNG of one pixel, whose header states 100 000 x 100 000 pixels."""
    Image.new("L", (1, 1)).save(path)
    content = bytearray(path.read_bytes())
    header = content.index(b"IHDR")
    content[header + 4 : header + 12] = struct.pack(">2I", 100_000, 100_000)
    checksum = zlib.crc32(content[header : header + 17])
    content[header + 17 : header + 21] = struct.pack(">I", checksum)
    path.write_bytes(content)
    return bytes(content)


def test_a_file_that_states_a_huge_picture_is_kept_and_refused_in_one_line(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "mine.png"
    content = write_png_that_states_a_huge_size(path)
    assert _iso(source, "--channel", "0", "--tile", "r0_c0", "-o", str(path)) == 1
    error = capsys.readouterr().err
    assert f"{path}: holds " in error
    assert "expected nothing or a picture of the same source" in error
    assert error.count("\n") == 1
    assert path.read_bytes() == content
