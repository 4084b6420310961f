"""Words of a command line that no flag can take: one line each, which names the flag."""

import subprocess
import sys
from pathlib import Path

import pytest

from stereocell.cli.__main__ import _parser, main
from stereocell.cli.words import prepared
from stereocell.export.options import ExportOptions
from stereocell.model.errors import StereoCellError, UsageError

PLAN = ["plan", "in.tif", "-o", "out"]
FLAGS = sorted(
    option
    for action in _parser()._subparsers._group_actions[0].choices["plan"]._actions  # type: ignore[union-attr]
    if action.nargs != 0
    for option in action.option_strings
)


def refusal(capsys: pytest.CaptureFixture[str], words: list[str], code: int = 2) -> str:
    assert main(words) == code
    line = capsys.readouterr().err
    assert line.count("\n") == 1
    return line.strip().removeprefix("stereocell: ")


def test_the_flags_of_a_plan_are_found() -> None:
    assert {"--preset", "--config", "--iso-value", "--labels", "--columns", "-o"} <= set(FLAGS)


@pytest.mark.parametrize("flag", FLAGS)
def test_two_hyphens_are_refused_as_a_value(flag: str, capsys: pytest.CaptureFixture[str]) -> None:
    expected = f"{flag} is '--', expected a value (a file of this name is ./--)"
    assert refusal(capsys, [*PLAN, f"{flag}=--"]) == expected


def test_other_commands_refuse_two_hyphens_as_a_value(capsys: pytest.CaptureFixture[str]) -> None:
    for words in (["export", "o", "x.stl", "--scale=--"], ["tissue", "o", "--model=--"]):
        assert refusal(capsys, words).startswith(f"{words[-1][:-3]} is '--', expected a value")


def test_words_behind_two_hyphens_are_names() -> None:
    assert prepared(["check", "--", "--json=--"]) == ["check", "--", "--json=--"]


def test_values_below_zero_are_joined_to_their_flags() -> None:
    assert prepared(["--region", "-2:2,:,:", "-5"]) == ["--region=-2:2,:,:", "-5"]


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ([*PLAN, "--channels", "\udcff"], "--channels is '\\xff', expected UTF-8"),
        ([*PLAN, "--preset=a\udce9"], "--preset is 'a\\xe9', expected UTF-8"),
        ([*PLAN[:3], "\udcff"], "-o is '\\xff', expected UTF-8"),
        (["plan", "caf\udce9.tif", "-o", "out"], "argument 2 is 'caf\\xe9.tif', expected UTF-8"),
        ([*PLAN, "--labels=a\udce9=b"], "--labels is 'a\\xe9=b', expected UTF-8"),
        ([*PLAN, "--\udce9"], "argument 5 is '--\\xe9', expected UTF-8"),
        (["export", "out", "\udcff.glb"], "argument 3 is '\\xff.glb', expected UTF-8"),
        ([*PLAN, "--preset", "\ud800"], "--preset is '\\ud800', expected UTF-8"),
    ],
)
def test_bytes_that_are_not_utf8_are_named(
    words: list[str], expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert refusal(capsys, words).startswith(expected)


@pytest.mark.skipif(sys.platform == "win32", reason="arguments of Windows are no bytes")
def test_bytes_that_a_shell_passes_are_named() -> None:
    words = [sys.executable, "-m", "stereocell.cli", "plan", b"\xff", "-o", "out"]
    done = subprocess.run(words, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr == ("stereocell: argument 2 is '\\xff', expected UTF-8: rename the file\n")


def test_settings_that_are_not_utf8_name_the_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "mine.toml"
    file.write_bytes(b'[plan]\ngrid = "\xff"\n')
    expected = f"{file}: line 2: found byte 0xff, expected UTF-8"
    assert refusal(capsys, ["settings", "--config", str(file)]).startswith(expected)


@pytest.mark.parametrize("flag", ["--preset", "--config", "--grid", "--columns", "--iso-value"])
@pytest.mark.parametrize("value", ["x" * 5000, "x y " * 1250, "\u4e2d" * 5000])
def test_long_values_are_cut(flag: str, value: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*PLAN, flag, value]) in (1, 2)
    line = capsys.readouterr().err
    assert line.count("\n") == 1
    assert len(line) < 700


def test_a_message_cuts_long_values_and_leaves_others() -> None:
    path = "data/" + "a" * 200 + ".tif"
    assert str(StereoCellError(f"{path}: found 3, expected 4")) == f"{path}: found 3, expected 4"
    line = str(StereoCellError(f"name {'y' * 5000!r} is unknown"))
    assert line == f"name '{'y' * 199}...{'y' * 59}' is unknown"


def test_an_unknown_preset_shows_no_path_of_the_package(capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("x" * 300, "../presets/cycif", "a\nb"):
        line = refusal(capsys, ["settings", "--preset", name])
        assert line.startswith("preset ")
        known = "ct, ct-bone, cycif, em, lightsheet, mri, pet, vessels"
        assert line.endswith(f"is unknown, expected one of {known} or a .toml file")


@pytest.mark.parametrize("address", ["s3://", "s3:///", "https://", "file://"])
def test_an_address_without_a_place_is_refused(
    address: str, capsys: pytest.CaptureFixture[str]
) -> None:
    for words in (["publish", "out", address], ["check", address], ["plan", address, "-o", "out"]):
        assert f"is '{address}', expected more behind it" in refusal(capsys, words)


@pytest.mark.parametrize("scale", ["1e300", "1e-300", "1e10", "1e-10"])
def test_scales_of_exports_have_bounds(scale: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(UsageError, match="expected 1e-09 to 1e"):
        ExportOptions(scale=float(scale))


def test_a_line_break_in_a_name_is_escaped(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "a\nb.ome.tif"
    assert refusal(capsys, ["check", str(out)], 1).startswith(f"{tmp_path}/a\\nb.ome.tif: ")
    assert main(["sample", "brain-cells", str(out)]) == 0
    assert capsys.readouterr().out == f"wrote {tmp_path}/a\\nb.ome.tif\n"
