"""The ending chooses the format, impossible options are refused, and errors leave no file."""

import argparse
import json
import re
import shutil
import subprocess
import sys
from contextlib import suppress
from dataclasses import fields
from pathlib import Path

import pytest

from stereocell.cli.__main__ import main
from stereocell.cli.flags import declare_export
from stereocell.export import volume_files
from stereocell.export.endings import PAGE, TAKES
from stereocell.export.options import ExportOptions, parse_region
from stereocell.export.write import FORMATS, export_stage
from stereocell.model.errors import OutputError, UsageError
from support.exhaustive import sweep


def test_an_unknown_ending_and_an_option_of_others_are_refused(
    sphere_stage: Path, tmp_path: Path
) -> None:
    with pytest.raises(
        UsageError,
        match=r"s\.fbx: found the ending '\.fbx', expected a name that ends in one of \.glb",
    ):
        export_stage(sphere_stage, tmp_path / "s.fbx", options=ExportOptions())
    with pytest.raises(
        UsageError,
        match=r"--compress does not apply to \.stl, expected a file that ends in one of \.glb",
    ):
        export_stage(sphere_stage, tmp_path / "s.stl", options=ExportOptions(compress="draco"))


def test_unknown_channels_and_tiles_are_refused(sphere_stage: Path, tmp_path: Path) -> None:
    with pytest.raises(
        UsageError, match="--channels names 'CD4', expected one or more of CD31, Hoechst 33342"
    ):
        export_stage(sphere_stage, tmp_path / "s.glb", options=ExportOptions(channels=("CD4",)))
    with pytest.raises(
        UsageError, match="--tiles names 'r9_c9', expected visible tiles, one or more of r0_c0"
    ):
        export_stage(sphere_stage, tmp_path / "s.glb", options=ExportOptions(tiles=("r9_c9",)))


@pytest.mark.parametrize("text", ["1:2,3:4", "2:1,:,:", "a:b,:,:", "1:2,:,:,:"])
def test_a_region_is_three_spans(text: str) -> None:
    with pytest.raises(UsageError, match="--region is"):
        parse_region(text)


@pytest.mark.parametrize("words", [["--region", "-9:12,-5.5:,:"], ["--region=-9:12,-5.5:,:"]])
def test_a_region_may_begin_left_of_zero(
    sphere_stage: Path, tmp_path: Path, words: list[str]
) -> None:
    """Patients have negative coordinates, and argparse could take the minus for another flag."""
    shutil.copytree(sphere_stage.parent, tmp_path / "out" / "stage")
    file = tmp_path / "s.glb"
    assert main(["export", str(tmp_path / "out"), *words, str(file)]) == 0
    assert file.is_file()


def test_rest_of_a_killed_command_is_removed(sphere_stage: Path, tmp_path: Path) -> None:
    (tmp_path / ".s.glb.0123abcd.partial").mkdir()
    (tmp_path / ".t.glb.0123abcd.partial").mkdir()  # rest of another file
    export_stage(sphere_stage, tmp_path / "s.glb", options=ExportOptions())
    assert {one.name for one in tmp_path.iterdir()} == {"s.glb", ".t.glb.0123abcd.partial"}


def test_missing_folder_of_the_file_is_made(sphere_stage: Path, tmp_path: Path) -> None:
    export_stage(sphere_stage, tmp_path / "for" / "printing" / "s.stl", options=ExportOptions())
    assert [one.name for one in (tmp_path / "for" / "printing").iterdir()] == ["s.stl"]
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match=r"file: can't be made \("):
        export_stage(sphere_stage, tmp_path / "file" / "s.stl", options=ExportOptions())


def test_a_failure_half_way_leaves_the_older_file(
    sphere_stage: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "s.raw").write_text("old")

    def fail(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(volume_files, "nrrd_head", fail)
    with pytest.raises(OutputError, match=r"s\.raw: can't be written: No space left"):
        export_stage(sphere_stage, tmp_path / "s.raw", options=ExportOptions())
    assert [one.name for one in tmp_path.iterdir()] == ["s.raw"]
    assert (tmp_path / "s.raw").read_text("utf-8") == "old"


def test_parts_of_a_build_and_edits_are_not_overwritten(
    sphere_stage: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    shutil.copytree(sphere_stage.parent, out / "stage")
    edit = tmp_path / "edit.usda"
    edit.write_text("#usda 1.0\n(subLayers = [@./out/stage/stage.usda@])\n")
    for file in (out / "stage" / "stage.usda", out / "stage" / "new.glb", out / "bundle" / "a.glb"):
        assert main(["export", str(out), str(file)]) == 2
        assert "found a part of the build, expected another place" in capsys.readouterr().err
    assert main(["export", str(out), str(edit), "--stage", str(edit)]) == 2
    assert edit.read_text("utf-8").startswith("#usda 1.0\n(subLayers")
    assert main(["export", str(out), str(out / "s.glb"), "--json"]) == 0
    printed = capsys.readouterr()
    lines = json.loads(printed.out)["lines"]
    assert len(lines) == 1
    assert lines[0].startswith("2 meshes, ")
    assert "export: 2/2 r0_c1" in printed.err


def test_options_of_all_endings_are_flags_of_the_command() -> None:
    known = {field.name for field in fields(ExportOptions)}
    assert TAKES.keys() == {*FORMATS, PAGE}
    assert frozenset[str]().union(*TAKES.values()) | {"channels"} == known


def test_help_of_a_flag_names_all_endings_that_take_it() -> None:
    parser = argparse.ArgumentParser()
    declare_export(parser)
    listing = set()
    for action in parser._actions:
        named = set(re.findall(r"\.[a-z0-9]+", action.help or "")) & FORMATS.keys()
        if len(named) > 1:  # otherwise the help is about one format
            takers = {one for one in FORMATS if action.dest in TAKES[one]}
            assert named == takers - {".nii.gz"}, action.dest
            listing.add(action.dest)
    assert listing == {"units", "unity", "width"}


def test_the_command_needs_a_stage(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(tmp_path), str(tmp_path / "s.glb"), "--json"]) == 1
    printed = capsys.readouterr()
    assert "stereocell:" in printed.err
    assert json.loads(printed.out)["exit_code"] == 1
    assert not (tmp_path / "s.glb").exists()


@pytest.mark.slow
@pytest.mark.parametrize("ending", sweep(sorted(FORMATS), kept=[".precomputed"]))
def test_a_full_disk_is_one_line_and_leaves_nothing(
    sphere_stage: Path, small_disk: Path, capfd: pytest.CaptureFixture[str], ending: str
) -> None:
    """Runs in a process of its own, which a mapped file without space on the disk would kill."""
    out = small_disk.parent / "out"
    shutil.copytree(sphere_stage.parent, out / "stage")
    full = small_disk / "full"
    with suppress(OSError), full.open("wb", buffering=0) as file:
        while True:
            file.write(bytes(4096))
    with full.open("r+b") as file:
        file.truncate(full.stat().st_size - 8192)  # leaves space for folders and heads
    file = small_disk / f"a{ending}"
    command = [sys.executable, "-m", "stereocell.cli", "export", str(out), str(file)]
    answer = subprocess.run(command, capture_output=True, text=True, check=False)
    if answer.returncode == 0:  # the sphere's file is small enough for the remaining space
        assert file.stat().st_size <= 8192
        return
    assert answer.returncode == 1, answer.stderr
    printed = answer.stderr.splitlines()[-1]
    assert printed.startswith(f"stereocell: {file}: "), printed
    assert {one.name for one in small_disk.iterdir()} == {"full"}
