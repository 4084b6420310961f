"""The command line: contradictory flags, missing arguments, and exit codes."""

import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from stereocell.building.out_folder import OutFolder
from stereocell.cli.__main__ import COMMANDS, main
from stereocell.storage.processes import cores
from support import phantoms, plain_bundle


@pytest.fixture
def source(tmp_path: Path) -> Path:
    body = phantoms.f_phantom()
    return phantoms.write_ome_tiff(
        tmp_path / "f.ome.tif", np.stack([body, body]), axes="CZYX", names=["F body", "F again"]
    )


def _refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """Run a command with wrong usage; return its only line."""
    capsys.readouterr()
    assert main(arguments) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1, lines
    return lines[0].removeprefix("stereocell: ")


def test_python_runs_the_package_as_the_command() -> None:
    answer = subprocess.run(
        [sys.executable, "-m", "stereocell", "plan"], capture_output=True, text=True, check=False
    )
    assert answer.returncode == 2
    assert answer.stderr.startswith("stereocell: ")


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        (
            ["--grid", "2x1", "--tile-size", "8,8,8"],
            "--grid and --tile-size both set the size of tiles",
        ),
        (["--channels="], "--channels is '', expected names or indices"),
        (["--channels", ","], "--channels is ',', expected names or indices"),
        (["--channels", "0,,1"], "--channels is '0,,1', expected names or indices"),
        (["--channels", "nope"], "channel 'nope': not found, expected one of F body, F again or"),
        (["--channels", "2"], "channel '2': not found, expected an index from 0 to 1"),
        (["--time", "9"], "--time: found 9, expected 0 to 0"),
        (["--time=-1"], "--time is -1, expected 0 or more"),
        (
            ["--iso-value", "7=500"],
            "--iso-value names channel '7', expected one of F body,",
        ),
        (["--paint", "0=1", "--paint", "0=2"], "--paint names channel '0' twice, expected once"),
        (
            ["--iso-value", "F body=1", "--iso-value", "F body=2"],
            "--iso-value names channel 'F body' twice, expected once",
        ),
        (["--preset", "mri", "--spacing-um", ".2,.01,.01"], "0.2 um apart, expected 4 or more"),
    ],
)
def test_wrong_usage_is_one_line_and_leaves_nothing(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], flags: list[str], message: str
) -> None:
    out = tmp_path / "out"
    assert message in _refused(capsys, "plan", str(source), "-o", str(out), *flags)
    assert not out.exists()


def test_out_inside_the_input_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = phantoms.write_ome_zarr(tmp_path / "v.ome.zarr", [phantoms.f_phantom()])
    for out in (path, path / "out"):
        line = _refused(capsys, "build", str(path), "-o", str(out), "--workers", "0")
        assert "inside the input" in line
    assert sorted(file.name for file in path.iterdir()) == ["0", "zarr.json"]


@pytest.mark.parametrize("name", ["a\nb", "a\nb/out", "bell\a"])
def test_out_that_usd_cannot_name_is_refused_before_any_work(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    home = tmp_path / "home"
    home.mkdir()
    line = _refused(capsys, "build", str(source), "-o", str(home / name), "--workers", "0")
    assert "expected a path without control characters" in line
    assert list(home.iterdir()) == []


def test_an_iso_value_by_index_is_kept_by_name(source: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    flags = ["--grid", "2x1", "--iso-value", "1=400"]
    assert main(["plan", str(source), "-o", str(out), *flags]) == 0
    assert OutFolder(out).plan().settings.iso_values == {"F again": 400.0}


def test_settings_file_of_a_build_makes_the_same_plan(source: Path, tmp_path: Path) -> None:
    first, second, third = (tmp_path / name for name in "abc")
    assert main(["plan", str(source), "-o", str(first), "--grid", "5x3", "--region", ":,:,1:"]) == 0
    used = ["--config", str(first / "stereocell.toml")]
    assert main(["plan", str(source), "-o", str(second), *used]) == 0
    assert OutFolder(second).plan().tiles == OutFolder(first).plan().tiles
    assert OutFolder(second).plan().settings == OutFolder(first).plan().settings
    assert main(["plan", str(source), "-o", str(third), *used, "--tile-size", "16,48,36"]) == 0
    assert len(OutFolder(third).plan().tiles) == 1


def test_printed_settings_begin_as_a_template_and_those_of_a_build_as_a_record(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["settings"]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("# StereoCell settings. Every key may be left out")
    assert main(["plan", str(source), "-o", str(tmp_path / "out")]) == 0
    left = (tmp_path / "out" / "stereocell.toml").read_text("utf-8")
    assert left.startswith("# The settings that this build used")
    assert tomllib.loads(left).keys() == tomllib.loads(printed).keys()


def test_default_number_of_workers_is_the_number_of_usable_cores(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from stereocell.cli import __main__ as cli

    # Undoes the default of tests, which is no workers.
    monkeypatch.setattr("stereocell.cli.flags.cores", cores)
    with monkeypatch.context() as patch:
        patch.setattr(os, "sched_getaffinity", lambda process: {3}, raising=False)
        assert cli._parser().parse_args(["units", "out"]).workers == 1
    assert 1 <= cli._parser().parse_args(["units", "out"]).workers <= (os.cpu_count() or 1)
    # A container that may use half of a core's time.
    monkeypatch.setattr("stereocell.storage.processes.container_cores", lambda: 0.5)
    assert cli._parser().parse_args(["units", "out"]).workers == 1


def test_help_says_what_a_region_counts(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["build", "--help"])
    assert "voxels of the resolution level that is built" in " ".join(
        capsys.readouterr().out.split()
    )
    assert "build" in COMMANDS


def test_json_flag_prints_json(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = str(tmp_path / "out")
    assert main(["plan", str(source), "-o", out, "--grid", "2x1", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["out"] == out
    assert answer["tiles"] == ["r0_c0", "r0_c1"]
    assert answer["channels"] == ["F body", "F again"]
    assert main(["settings", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["plan"]["grid"] == ""
    assert main(["plan", str(tmp_path / "none.tif"), "-o", out, "--json"]) == 1
    printed = capsys.readouterr()
    answer = json.loads(printed.out)
    assert answer["exit_code"] == 1
    assert printed.err == f"stereocell: {answer['error']}\n"
    assert main(["plan", str(source), "-o", out, "--level", "9", "--json"]) == 2
    assert json.loads(capsys.readouterr().out)["exit_code"] == 2
    assert main(["plan", "--nonsense", "--json"]) == 2
    printed = capsys.readouterr()
    assert json.loads(printed.out)["exit_code"] == 2
    (line,) = printed.err.splitlines()
    assert line.startswith("stereocell: the following arguments are required: input")
    assert "`stereocell plan --help`" in line


def test_without_a_terminal_progress_is_one_plain_line_per_unit(
    source: Path, tmp_path: Path
) -> None:
    out = str(tmp_path / "out")
    assert main(["plan", str(source), "-o", out, "--grid", "2x1"]) == 0
    command = [sys.executable, "-m", "stereocell.cli", "units", out, "--workers", "0"]
    printed = subprocess.run(command, capture_output=True, text=True, check=True)
    lines = printed.stderr.splitlines()
    assert "units: 1/4 r0_c0/F body" in lines
    assert "units: 4/4 r0_c1/F again" in lines
    assert "\x1b" not in printed.stderr
    assert printed.stdout == ""


def test_help_lists_the_exit_codes(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--help"])
    printed = capsys.readouterr().out
    assert all(f"\n  {code:<5}" in printed for code in ("0", "1", "2", "130", "141", "143"))


def test_no_color_turns_colours_off() -> None:
    progress = (
        "from stereocell.engine import run as engine\n"
        "with engine._progress('units', 2) as advance:\n"
        "    advance('r0_c0/CD31', True)"
    )

    def colours(**given: str) -> list[str]:
        kept = {key: value for key, value in os.environ.items() if key != "NO_COLOR"}
        terminal = {"FORCE_COLOR": "1", "TERM": "xterm-256color", **given}
        command = [sys.executable, "-c", progress]
        printed = subprocess.run(command, env={**kept, **terminal}, capture_output=True, check=True)
        assert b"1 failed" in printed.stderr
        return re.findall(r"\x1b\[[\d;]+m", printed.stderr.decode())

    assert "\x1b[31m" in colours()
    assert colours(NO_COLOR="1") == []


@pytest.mark.parametrize(
    ("arguments", "code", "expected"),
    [
        (["settings"], 141, ""),
        (["settings", "--json"], 141, ""),
        (["check", "no-such-folder", "--json"], 141, "stereocell: no-such-folder: "),
        (["view", "BUNDLE", "--port", "0", "--no-browser"], 141, ""),
    ],
)
def test_closed_pipe_is_not_an_error(
    arguments: list[str], code: int, expected: str, tmp_path: Path
) -> None:
    plain_bundle.write(tmp_path, plain_bundle.FILES)
    arguments = [str(tmp_path / "bundle") if word == "BUNDLE" else word for word in arguments]
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "stereocell.cli", *arguments]
    done = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, text=True)
    os.close(writer)
    assert done.returncode == code
    assert done.stderr.startswith(expected)
    assert len(done.stderr.splitlines()) == bool(expected)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full")
@pytest.mark.parametrize("flags", [[], ["--json"]])
def test_full_disk_under_stdout_is_an_error_of_one_line(flags: list[str]) -> None:
    command = [sys.executable, "-m", "stereocell.cli", "settings", *flags]
    with open("/dev/full", "w") as full:
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 1
    assert done.stderr == "stereocell: stdout: No space left on device\n"


def test_impossible_port_is_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["view", "out/mine", "--port", "99999"]) == 2
    assert "'99999' is not a port, expected 0 to 65535" in capsys.readouterr().err
