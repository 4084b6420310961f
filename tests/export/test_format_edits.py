"""In files for other programs, an edit of the stage is applied, or a line states that it is not."""

import hashlib
from collections.abc import Callable
from pathlib import Path

import pytest

from stereocell.cli.__main__ import main
from stereocell.export.options import ExportOptions
from stereocell.export.write import FORMATS, export_stage
from stereocell.model.errors import StageError
from stereocell.storage.file_list import encode, list_files
from support.edit_cases import CASES, EditCase
from support.exhaustive import sweep

# These endings are not tried: their writers are tried by another ending, or turntables take long.
ALIKE = (".gltf", ".usda", ".mp4", ".webm", ".raw", ".nii.gz")
TRIED = [ending for ending in FORMATS if ending not in ALIKE]
# If the only channel with a surface is hidden, it is drawn nevertheless, to draw anything at all.
ONLY_ONE = "visibility of `/Specimen/Shown/CHANNEL`"


def write(stage: Path, folder: Path, ending: str) -> tuple[str, list[str]]:
    """Export a stage; return a digest of the files, and the lines on edits that are left out."""
    folder.mkdir()
    lines: list[str] = []
    options = ExportOptions(width=200) if ending == ".png" else ExportOptions()
    export_stage(stage, folder / f"s{ending}", options=options, report=lines.append)
    digest = hashlib.sha256(encode(list_files(folder, root=folder))).hexdigest()
    return digest, [line for line in lines if "is not taken over" in line]


def unlike(case: EditCase, has_changed: bool, lines: list[str], ending: str) -> bool:
    """Return whether a file and the reported lines contradict each other about an edit."""
    if case.what == ONLY_ONE and FORMATS[ending].is_seen:
        return False
    if FORMATS[ending].lacks is None:
        return bool(lines)  # a flattened stage has all composed edits
    if case.outcome == "reported":
        return not any(case.words in line for line in lines)
    return has_changed == bool(lines)


@pytest.mark.slow
@pytest.mark.parametrize("ending", sweep(TRIED, kept=[".glb", ".stl", ".nrrd"]))
def test_each_edit_is_in_the_file_or_is_reported(
    edited: Callable[..., Path], tmp_path: Path, ending: str
) -> None:
    before, none = write(edited(lambda _: None), tmp_path / "before", ending)
    assert none == []
    wrong = []
    for number, case in enumerate(CASES):
        if case.outcome == "refused" or case.is_partial:
            continue
        (tmp_path / "edited.usda").unlink()
        after, lines = write(edited(case.change), tmp_path / str(number), ending)
        if unlike(case, after != before, lines, ending):
            wrong.append((case.what, after != before, lines))
    assert wrong == []


def case_of(what: str) -> EditCase:
    return next(case for case in CASES if case.what == what)


@pytest.mark.parametrize(
    ("what", "ending", "words"),
    [
        (
            "`inputs:color` of a channel",
            ".stl",
            "CD31.inputs:color is not taken over: the file has",
        ),
        ("a camera", ".glb", "Camera /Specimen/Cameras/close is not taken over: the file has no"),
        ("an added mesh", ".3mf", "Mesh /Specimen/Annotations/Arrow is not taken over: the file"),
        (
            "an added mesh or curve without faces",
            ".glb",
            "Mesh /Specimen/Annotations/Nothing is not taken over: it has no faces",
        ),
        (
            "`displayOpacity` of a mesh",
            ".ply",
            "primvars:displayOpacity is not taken over: the file has only the colour of a ma",
        ),
    ],
)
def test_line_names_edits_that_a_format_has_no_field_for(
    edited: Callable[..., Path], tmp_path: Path, what: str, ending: str, words: str
) -> None:
    _, lines = write(edited(case_of(what).change), tmp_path / "out", ending)
    assert len(lines) == 1
    assert words in lines[0]


@pytest.mark.parametrize("ending", [".glb", ".usdz"])
def test_file_of_some_tiles_reports_that_it_has_no_additions(
    edited: Callable[..., Path], tmp_path: Path, ending: str
) -> None:
    lines: list[str] = []
    stage, file = edited(case_of("an added mesh").change), tmp_path / f"s{ending}"
    options = ExportOptions(tiles=("r0_c0",))
    export_stage(stage, file, options=options, report=lines.append)
    (line,) = [line for line in lines if "is not taken over" in line]
    assert "Arrow is not taken over: a file of some tiles or of a region has" in line


def test_a_color_that_repeats_the_stage_s_own_needs_no_line(
    edited: Callable[..., Path], tmp_path: Path
) -> None:
    def repeat(stage: object) -> None:
        color = stage.GetAttributeAtPath("/Specimen/Channels/CD31.inputs:color")
        color.Set(color.Get())

    assert write(edited(repeat), tmp_path / "out", ".stl")[1] == []


def test_strict_writes_nothing_where_an_edit_is_left_out(
    edited: Callable[..., Path], tmp_path: Path
) -> None:
    stage = edited(case_of("`inputs:color` of a channel").change)
    file = tmp_path / "s.stl"
    with pytest.raises(StageError, match=r"found 1 edit that \.stl leaves out, expected none with"):
        export_stage(stage, file, options=ExportOptions(strict=True))
    assert not file.exists()
    export_stage(stage, tmp_path / "s.glb", options=ExportOptions(strict=True))


def test_edits_over_time_are_refused(edited: Callable[..., Path], tmp_path: Path) -> None:
    stage = edited(case_of("`inputs:color` over time").change)
    with pytest.raises(StageError, match=r"CD31\.inputs:color: found values over time"):
        write(stage, tmp_path / "out", ".glb")


def test_a_page_has_the_edits_of_its_bundle(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", str(tmp_path), str(tmp_path / "s.html"), "--strict"]) == 2
    assert "--strict does not apply to .html" in capsys.readouterr().err
