"""`stereocell iso`: a picture and a table of one tile's candidates, and nothing else."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import phantoms
from stereocell.cli import main
from stereocell.config import load
from stereocell.iso_preview import COLORS, preview
from stereocell.isovalue import CRITERIA

SPACING = (1.0, 1.0, 1.0)
CONSTANT = 100


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A ball on a level of 100 + 1000 in the left tile of channel 0; channel 1 is constant."""
    ball = phantoms.blurred_ball((24, 32, 64), SPACING, (12.0, 16.0, 16.0), 8.0, 1.0)
    counts = phantoms.as_counts(ball, 100, 1100, noise=10.0)
    channels = np.stack([counts, np.full_like(counts, CONSTANT)])
    path = tmp_path_factory.mktemp("preview") / "ball.ome.zarr"
    scales = [{"c": 1.0, **dict.fromkeys("zyx", 1.0)}]
    return phantoms.write_ome_zarr(path, [channels], "czyx", scales=scales)


def _iso(source: Path, *flags: str) -> int:
    return main(["iso", str(source), "--tile-size", "24,32,32", *flags])


def test_the_table_names_every_criterion_with_levels_and_shares(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "ball.png"
    assert _iso(source, "--channel", "0", "--tile", "r0_c0", "-o", str(out)) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert rows[0][0] == "candidate"
    assert rows[1][:2] == ["edges", "*"]
    assert {row[0] for row in rows[1:-1]} == set(CRITERIA)
    assert rows[-1] == ["wrote", str(out)]
    _, _, above, raw, inside, confidence = rows[1]
    ball = 4 / 3 * np.pi * 8**3 / (24 * 32 * 32)
    # a ball blurred by s has .5 - s / (R sqrt(2 pi)) of its height at R; the smoothing adds 1 um
    height = 0.5 - np.sqrt(2) / (8 * np.sqrt(2 * np.pi))
    assert float(above) == pytest.approx(1000 * height, rel=0.1)
    assert float(raw) - float(above) == pytest.approx(100, abs=10)
    assert float(inside.rstrip("%")) / 100 == pytest.approx(ball, rel=0.1)
    assert float(confidence) > 0.9


def test_the_picture_has_every_candidate_s_colour_and_nothing_else_is_written(
    source: Path, tmp_path: Path
) -> None:
    out = tmp_path / "ball.png"
    flags = ("--iso-value", "0=600", "--iso-criterion", "pekar-mean")
    assert _iso(source, "--channel", "0", "--tile", "r0_c0", "-o", str(out), *flags) == 0
    assert list(tmp_path.iterdir()) == [out]
    pixels = {tuple(p) for p in np.asarray(Image.open(out)).reshape(-1, 3).tolist()}
    assert set(COLORS.values()) <= pixels


def test_a_value_that_is_given_is_the_chosen_one_in_voxels_as_they_are(
    source: Path, tmp_path: Path
) -> None:
    flags = {"plan": {"tile_size": [24, 32, 32]}, "iso_values": {"0": 600.0}}
    candidates, _ = preview(str(source), "0", "r0_c0", tmp_path / "a.png", load(None, None, flags))
    chosen = next(c for c in candidates if c.is_chosen)
    assert (chosen.name, chosen.level, chosen.raw, chosen.confidence) == ("given", 600, 600, None)
    assert [c.is_chosen for c in candidates].count(True) == 1


def test_same_input_same_bytes(source: Path, tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        flags = ("--channel", "0", "--tile", "r0_c0", "-o", str(tmp_path / name))
        assert _iso(source, *flags) == 0
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_picture_is_named_by_channel_and_tile_unless_told(
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
        (("--channel", "1", "--tile", "r0_c0"), 1, "every voxel is 100: no surface to look at"),
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
