"""Export a built OUT to one file for another program. The file's ending selects the format."""

import secrets
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from stereocell.building.out_folder import OutFolder
from stereocell.building.own_parts import no_layer
from stereocell.building.sealed_documents import require_documents
from stereocell.export import format_edits as edits
from stereocell.export.chosen import Chosen, Report
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
from stereocell.export.scene import MAX_MB, write_scene
from stereocell.export.usd_files import write_flattened, write_light_copy
from stereocell.export.volume_files import described_by, write_nifti, write_nrrd, write_raw
from stereocell.export.written import is_own, remember
from stereocell.model.errors import OutputError, UsageError
from stereocell.storage.atomic_write import put_in_place
from stereocell.storage.overwriting import require_free
from stereocell.storage.temporary_names import clear_beside
from stereocell.usd.lost_edits import WHOLE, notes_on_edits, require_no_lost_edit
from stereocell.usd.read_additions import notes_on_additions
from stereocell.usd.stage_files import dependencies
from stereocell.usd.typed_values import usd_boundary
from stereocell.usd.write_usdz import MAX_TRIANGLES
from stereocell.usd.written_files import CHANGED

_EXPECTED = "nothing or an earlier export of this build, as it was written"
_LEVELS = frozenset({"strict", "tiles", "lod", "max_triangles", "max_bytes", "region", "scale"})


@dataclass(frozen=True, slots=True)
class Format:
    """One file format of `export`: how files with its ending are written.

    write        writes the file at a level of detail (0 if the format has no levels), and returns a
                 sentence about the file
    takes        names of the options that the format accepts, besides --channels
    lacks        kinds of edits that the format can't hold; None: it holds all composed content
    triangles    largest number of triangles without --lod and --max-triangles; if all levels have
                 more, the coarsest is written
    is_seen      whether the format is for viewing; then, without --channels, it has the channels
                 that the viewer shows at opening
    names_files  whether the file refers to files of OUT by path, so that OUT must be a local folder
    beside       returns the paths of further files that are written beside the file
    """

    write: Callable[[Chosen, Path, int], str]
    takes: frozenset[str]
    lacks: tuple[Lack, ...] | None
    triangles: int | None = None
    is_seen: bool = False
    names_files: bool = False
    beside: Callable[[Path, ExportOptions], list[Path]] = lambda _path, _options: []

    @property
    def has_levels(self) -> bool:
        return "lod" in self.takes


_USD = frozenset({"strict", "tiles", "lod", "max_triangles", "max_bytes", "scale"})
_PICTURE = frozenset({"strict", "tiles", "lod", "max_triangles", "region", "occlusion", "width"})
_VOLUME = frozenset({"strict", "tiles", "region", "units", "bits"})
_SOLID = _LEVELS | {"wall_mm", "units"}
_GLTF = Format(write_gltf, _LEVELS | {"compress", "occlusion"}, edits.OF_GLTF, is_seen=True)
FORMATS = {
    ".glb": _GLTF,
    ".gltf": _GLTF,
    ".stl": Format(write_print, _SOLID, edits.OF_STL),
    ".3mf": Format(write_print, _SOLID | {"components"}, edits.OF_SOLIDS),
    ".ply": Format(write_print, _SOLID, edits.OF_PLY),
    ".obj": Format(write_print, _SOLID, edits.OF_SOLIDS),
    ".usdz": Format(write_light_copy, _USD, edits.OF_USDZ, MAX_TRIANGLES, is_seen=True),
    ".usdc": Format(write_flattened, _USD, None, names_files=True),
    ".usda": Format(write_flattened, _USD, None, names_files=True),
    ".png": Format(write_picture, _PICTURE, edits.OF_PICTURES, PICTURE_TRIANGLES, is_seen=True),
    ".mp4": Format(write_turntable, _PICTURE, edits.OF_PICTURES, VIDEO_TRIANGLES, is_seen=True),
    ".webm": Format(write_turntable, _PICTURE, edits.OF_PICTURES, VIDEO_TRIANGLES, is_seen=True),
    ".nrrd": Format(write_nrrd, _VOLUME | {"unity"}, edits.OF_VOXELS),
    ".raw": Format(
        write_raw,
        _VOLUME | {"unity"},
        edits.OF_VOXELS,
        beside=lambda file, options: [described_by(file, options)],
    ),
    ".nii.gz": Format(write_nifti, _VOLUME, edits.OF_VOXELS),
    ".nii": Format(write_nifti, _VOLUME, edits.OF_VOXELS),
    ".precomputed": Format(
        write_precomputed, frozenset({"strict", "tiles", "region", "bits"}), edits.OF_PRECOMPUTED
    ),
}
PAGE = ".html"  # made from the bundle; all other formats are made from the stage
PAGE_TAKES = frozenset({"max_mb", "view"})
ENDINGS = (*FORMATS, PAGE)


def export(
    out: Path,
    file: Path,
    *,
    options: ExportOptions,
    stage: Path | None = None,
    report: Report = lambda _: None,
) -> str:
    """Write `file` from OUT's composed stage, or from a layer over it; return a sentence about it.

    stage  the layer over the stage; None: the stage itself

    Raises UsageError for an ending or option that is not possible, StageError if the stage can't be
    read, and OutputError if the file can't be written.
    """
    out_folder = OutFolder(out)
    if find_ending(file) == PAGE:
        line, made = _export_page(out_folder, file, options, is_staged=stage is not None)
        remember(out, made)
        return line
    require_documents(out_folder, "export")
    out_folder.require_finished("stage")
    path = stage if stage is not None else out_folder.stage_file
    if not out_folder.has(path):
        raise no_layer(path, is_given=stage is not None)
    if out_folder.is_stored and path.is_relative_to(out) and FORMATS[find_ending(file)].names_files:
        raise OutputError(
            f"{file.name}: refers to files of OUT by path, expected OUT in a folder, not in "
            "object storage: export .usdz"
        )
    # This raises StageError if the stage uses files outside of the layer's and the stage's folder.
    files = dependencies(path, out_folder.stage_dir)
    _require_outside(file, out_folder, files)
    ours = partial(is_own, out)
    line, made = _export(path, file, options=options, report=report, is_ours=ours)
    remember(out, made)
    return line


def export_stage(
    stage_path: Path, file: Path, *, options: ExportOptions, report: Report = lambda _: None
) -> str:
    """Write `file` from a stage; return a sentence about it, and further lines if needed.

    The file is written completely or not at all. The same stage gives the same bytes. Raises the
    same errors as `export`.
    """
    return _export(stage_path, file, options=options, report=report, is_ours=lambda _: False)[0]


def _export(
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
    _require_takes(ending, way.takes, options)
    for place in (file, *way.beside(file, options)):  # check all paths before the work begins
        require_free(place, expected=_EXPECTED, is_ours=is_ours(place))
    _make_folder_of(file)
    with usd_boundary(stage_path):
        chosen = Chosen(stage_path, options, report)
        if way.lacks is not None:
            lacks = (*way.lacks, edits.NO_ADDITIONS_OF_PART) if chosen.is_part else way.lacks
            _report_edits(chosen, lacks, ending)
        if way.is_seen:
            chosen.show_as_viewer()
    with usd_boundary(stage_path), _folder_beside(file) as beside:
        line = _write_smallest(chosen, way, beside / file.name)
        places = _put_all_in_place(file, beside, is_ours)
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


def _put_all_in_place(file: Path, beside: Path, is_ours: Callable[[Path], bool]) -> list[Path]:
    """Move all files from the temporary folder to their final places; return their paths."""
    # The file itself is moved last, so that all parts exist as soon as the file exists.
    made = sorted(beside.iterdir(), key=lambda one: one.name == file.name)
    places = [file.parent / one.name for one in made]
    for place in places:
        require_free(place, expected=_EXPECTED, is_ours=is_ours(place))
    for one, place in zip(made, places, strict=True):
        put_in_place(one, place, beside / "old")
    return places


def _export_page(
    out_folder: OutFolder, file: Path, options: ExportOptions, *, is_staged: bool
) -> tuple[str, list[Path]]:
    """Write a page of OUT's bundle; return a sentence about it, and its path."""
    if is_staged:
        raise UsageError(
            f"--stage does not apply to {PAGE}, which holds the bundle: run `stereocell bundle OUT "
            "--stage edited.usda` first, then export without --stage"
        )
    _require_takes(PAGE, PAGE_TAKES, options)
    require_documents(out_folder, "publish")
    out_folder.require_finished("bundle")
    _require_outside(file, out_folder, [])
    ours = partial(is_own, out_folder.out)
    require_free(file, expected=_EXPECTED, is_ours=ours(file))
    _make_folder_of(file)
    out_folder.fetch(out_folder.bundle_dir)
    with _folder_beside(file) as beside:
        line = write_scene(
            out_folder.bundle_dir,
            beside / file.name,
            channels=options.channels,
            max_mb=options.max_mb or MAX_MB,
            view=options.view or "",
        )
        return line, _put_all_in_place(file, beside, ours)


def _write_smallest(chosen: Chosen, way: Format, file: Path) -> str:
    """Write the file at the finest level that fits --max-bytes; return a sentence about it."""
    if not way.has_levels:
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


@contextmanager
def _folder_beside(file: Path) -> Iterator[Path]:
    """Yield an empty temporary folder beside a file, and remove it afterwards.

    Also removes folders that a killed command left. Raises OutputError if the file can't be
    written, for example without permission or space.
    """
    clear_beside(file)
    folder = file.with_name(f".{file.name}.{secrets.token_hex(4)}.partial")
    try:
        folder.mkdir()
        yield folder
    except OutputError as error:  # in the message, replace the file's temporary name
        raise OutputError(str(error).replace(str(folder / file.name), str(file))) from error
    except OSError as error:
        raise OutputError(f"{file}: can't be written: {error.strerror or error}") from error
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _require_outside(file: Path, out_folder: OutFolder, files: Sequence[Path]) -> None:
    """Raise UsageError if the file would replace a file of the build or an artist's layer."""
    place = file.resolve()
    made = [out_folder.out / name for name in ("stage", "bundle", "units", "report")]
    if place in {one.resolve() for one in files} or any(
        place.is_relative_to(folder.resolve()) for folder in made
    ):
        raise UsageError(
            f"{file}: found a part of the build, expected another place: choose one outside of it"
        )


def find_ending(file: Path) -> str:
    """Return the ending that selects the format. Raises UsageError if it is unknown."""
    name = file.name.lower()
    for ending in ENDINGS:
        if name.endswith(ending) and len(name) > len(ending):
            return ending
    raise UsageError(
        f"{file}: found the ending {file.suffix!r}, expected a name that ends in one of "
        f"{', '.join(ENDINGS)}"
    )


def _make_folder_of(file: Path) -> None:
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"{file.parent}: can't be made ({error.strerror or error}): choose another folder"
        ) from error


def _require_takes(ending: str, takes: frozenset[str], options: ExportOptions) -> None:
    every = {**{other: one.takes for other, one in FORMATS.items()}, PAGE: PAGE_TAKES}
    for name in sorted(options.given() - takes - {"channels"}):
        able = [other for other, taken in every.items() if name in taken]
        flag = name.replace("_", "-")
        raise UsageError(
            f"--{flag} does not apply to {ending}, expected a file that ends in one of "
            f"{', '.join(able)}"
        )
