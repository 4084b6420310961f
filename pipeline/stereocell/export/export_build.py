"""Export a built OUT to one file for another program. The file's ending selects the format."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from stereocell.building.out_folder import OutFolder
from stereocell.building.own_parts import no_layer
from stereocell.building.sealed_documents import require_documents
from stereocell.export.endings import PAGE, find_ending, require_takes
from stereocell.export.options import ExportOptions
from stereocell.export.put_files import EXPECTED, folder_beside, make_folder_of, put_all_in_place
from stereocell.export.scene import MAX_MB, write_scene
from stereocell.export.written import is_own, remember
from stereocell.model.errors import OutputError, UsageError
from stereocell.storage.overwriting import require_free


def export(
    out: Path,
    file: Path,
    *,
    options: ExportOptions,
    stage: Path | None = None,
    report: Callable[[str], None] = lambda _: None,
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
    # USD is slow to import, and a page does not need it.
    from stereocell.export.write import FORMATS, export_layer
    from stereocell.usd.stage_files import dependencies

    if out_folder.is_stored and path.is_relative_to(out) and FORMATS[find_ending(file)].names_files:
        raise OutputError(
            f"{file.name}: refers to files of OUT by path, expected OUT in a folder, not in "
            "object storage: export .usdz"
        )
    # This raises StageError if the stage uses files outside of the layer's and the stage's folder.
    files = dependencies(path, out_folder.stage_dir)
    _require_outside(file, out_folder, files)
    ours = partial(is_own, out)
    line, made = export_layer(path, file, options=options, report=report, is_ours=ours)
    remember(out, made)
    return line


def _export_page(
    out_folder: OutFolder, file: Path, options: ExportOptions, *, is_staged: bool
) -> tuple[str, list[Path]]:
    """Write a page of OUT's bundle; return a sentence about it, and its path."""
    if is_staged:
        raise UsageError(
            f"--stage does not apply to {PAGE}, which holds the bundle: run `stereocell bundle OUT "
            "--stage edited.usda` first, then export without --stage"
        )
    require_takes(PAGE, options)
    require_documents(out_folder, "publish")
    out_folder.require_finished("bundle")
    _require_outside(file, out_folder, [])
    ours = partial(is_own, out_folder.out)
    require_free(file, expected=EXPECTED, is_ours=ours(file))
    make_folder_of(file)
    out_folder.fetch(out_folder.bundle_dir)
    with folder_beside(file) as beside:
        line = write_scene(
            out_folder.bundle_dir,
            beside / file.name,
            channels=options.channels,
            max_mb=options.max_mb or MAX_MB,
            view=options.view or "",
        )
        return line, put_all_in_place(file, beside, ours)


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
