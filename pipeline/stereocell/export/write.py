"""Export a stage to one file for another program. The file's ending selects the format."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from stereocell.export import format_edits as edits
from stereocell.export.chosen import Chosen, Report
from stereocell.export.endings import PAGE, TAKES, find_ending, require_takes
from stereocell.export.format_edits import Lack
from stereocell.export.gltf_scene import write_gltf
from stereocell.export.neuroglancer import write_precomputed
from stereocell.export.options import ExportOptions
from stereocell.export.pictures import (
    PICTURE_TRIANGLES,
    VIDEO_TRIANGLES,
    write_picture,
    write_turntable,
)
from stereocell.export.print_solids import write_print
from stereocell.export.put_files import EXPECTED, folder_beside, make_folder_of, put_all_in_place
from stereocell.export.usd_files import write_flattened, write_light_copy
from stereocell.export.volume_files import described_by, write_nifti, write_nrrd, write_raw
from stereocell.model.errors import UsageError
from stereocell.storage.overwriting import require_free
from stereocell.usd.lost_edits import WHOLE, notes_on_edits, require_no_lost_edit
from stereocell.usd.read_additions import notes_on_additions
from stereocell.usd.typed_values import usd_boundary
from stereocell.usd.write_usdz import MAX_TRIANGLES
from stereocell.usd.written_files import CHANGED


@dataclass(frozen=True, slots=True)
class Format:
    """One file format of `export`: how files with its ending are written.

    write        writes the file at a level of detail (0 if the format has no levels), and returns a
                 sentence about the file
    lacks        kinds of edits that the format can't hold; None: it holds all composed content
    triangles    largest number of triangles without --lod and --max-triangles; if all levels have
                 more, the coarsest is written
    is_seen      whether the format is for viewing; then, without --channels, it has the channels
                 that the viewer shows at opening
    names_files  whether the file refers to files of OUT by path, so that OUT must be a local folder
    beside       returns the paths of further files that are written beside the file
    """

    write: Callable[[Chosen, Path, int], str]
    lacks: tuple[Lack, ...] | None
    triangles: int | None = None
    is_seen: bool = False
    names_files: bool = False
    beside: Callable[[Path, ExportOptions], list[Path]] = lambda _path, _options: []


_GLTF = Format(write_gltf, edits.OF_GLTF, is_seen=True)
FORMATS = {
    ".glb": _GLTF,
    ".gltf": _GLTF,
    ".stl": Format(write_print, edits.OF_STL),
    ".3mf": Format(write_print, edits.OF_SOLIDS),
    ".ply": Format(write_print, edits.OF_PLY),
    ".obj": Format(write_print, edits.OF_SOLIDS),
    ".usdz": Format(write_light_copy, edits.OF_USDZ, MAX_TRIANGLES, is_seen=True),
    ".usdc": Format(write_flattened, None, names_files=True),
    ".usda": Format(write_flattened, None, names_files=True),
    ".png": Format(write_picture, edits.OF_PICTURES, PICTURE_TRIANGLES, is_seen=True),
    ".mp4": Format(write_turntable, edits.OF_PICTURES, VIDEO_TRIANGLES, is_seen=True),
    ".webm": Format(write_turntable, edits.OF_PICTURES, VIDEO_TRIANGLES, is_seen=True),
    ".nrrd": Format(write_nrrd, edits.OF_VOXELS),
    ".raw": Format(
        write_raw,
        edits.OF_VOXELS,
        beside=lambda file, options: [described_by(file, options)],
    ),
    ".nii.gz": Format(write_nifti, edits.OF_VOXELS),
    ".nii": Format(write_nifti, edits.OF_VOXELS),
    ".precomputed": Format(write_precomputed, edits.OF_PRECOMPUTED),
}


def export_stage(
    stage_path: Path, file: Path, *, options: ExportOptions, report: Report = lambda _: None
) -> str:
    """Write `file` from a stage; return a sentence about it, and further lines if needed.

    The file is written completely or not at all. The same stage gives the same bytes.

    Raises UsageError for an ending or option that is not possible, StageError if the stage can't be
    read, and OutputError if the file can't be written.
    """
    line, _ = export_layer(
        stage_path, file, options=options, report=report, is_ours=lambda _: False
    )
    return line


def export_layer(
    stage_path: Path,
    file: Path,
    *,
    options: ExportOptions,
    report: Report,
    is_ours: Callable[[Path], bool],
) -> tuple[str, list[Path]]:
    """Write `file` and the files that belong to it; return a sentence about it, and all paths.

    is_ours  returns whether an existing file may be replaced
    """
    ending = find_ending(file)
    if ending == PAGE:
        raise UsageError(
            f"{file}: found a layer as the source of a page, expected OUT with its bundle: run "
            "`stereocell export OUT`"
        )
    way = FORMATS[ending]
    require_takes(ending, options)
    for place in (file, *way.beside(file, options)):  # check all paths before the work begins
        require_free(place, expected=EXPECTED, is_ours=is_ours(place))
    make_folder_of(file)
    with usd_boundary(stage_path):
        chosen = Chosen(stage_path, options, report)
        if way.lacks is not None:
            lacks = (*way.lacks, edits.NO_ADDITIONS_OF_PART) if chosen.is_part else way.lacks
            _report_edits(chosen, lacks, ending)
        if way.is_seen:
            chosen.show_as_viewer()
    with usd_boundary(stage_path), folder_beside(file) as beside:
        line = _write_smallest(chosen, ending, beside / file.name)
        places = put_all_in_place(file, beside, is_ours)
    for layer in sorted(chosen.as_written.changed):
        report(f"{layer}: {CHANGED}, and is used as it is")
    return line, places


def _report_edits(chosen: Chosen, lacks: tuple[Lack, ...], ending: str) -> None:
    """Report each edit that the file will not have. With --strict, raises StageError instead."""
    stage, lost = chosen.stage, partial(edits.left_out, lacks)
    more = list(edits.notes_on_functions(stage, lacks))
    if not edits.left_out(lacks, "addition", WHOLE):
        more += notes_on_additions(stage)
    if chosen.options.strict:
        require_no_lost_edit(stage, more, left_out=lost, taker=f"{ending} leaves out")
    for line in (*notes_on_edits(stage, lost), *more):
        chosen.report(line)


def _write_smallest(chosen: Chosen, ending: str, file: Path) -> str:
    """Write the file at the finest level that fits --max-bytes; return a sentence about it."""
    way = FORMATS[ending]
    if "lod" not in TAKES[ending]:
        return way.write(chosen, file, 0)
    most, size = chosen.options.max_bytes, 0
    for level in chosen.levels(light=way.triangles):
        line = way.write(chosen, file, level)
        size = file.stat().st_size
        if most is None or size <= most:
            return line
        chosen.report(f"lod{level} takes {size} bytes, more than --max-bytes {most}")
    raise UsageError(
        f"--max-bytes is {most}, expected at least {size}, as the smallest file has: raise it, or "
        "choose fewer --tiles or --channels"
    )
