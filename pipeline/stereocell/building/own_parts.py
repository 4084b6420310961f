"""Refuse to replace parts of OUT that no phase of a build wrote.

A phase writes its own parts again if they are out of date or damaged. It stops before writing if
it finds files that no phase wrote, or layers of the stage that were edited in place.
"""

from pathlib import Path

from stereocell.building.out_folder import OutFolder
from stereocell.bundle.manifest import MANIFEST, find_others, require_bundle
from stereocell.model.errors import OutputError
from stereocell.steps.tissue_files import FOLDER, RECORD
from stereocell.storage.contents import contents_of, is_ignored, words_for
from stereocell.storage.file_list import sizes_of
from stereocell.storage.kinds import Kind
from stereocell.storage.overwriting import is_forced, or_force, refused
from stereocell.storage.sealed_text import is_sealed_text
from stereocell.usd.written_files import ADVICE, CHANGED, DOUBTFUL, find_damage, read_stage_list


def require_own_places(out_folder: OutFolder, *, is_same_plan: bool) -> None:
    """Raise OutputError if a phase after the plan would replace files that no phase wrote.

    is_same_plan  whether the plan stays the same, so that edited layers of the stage stay, too

    All phases are checked before the first one writes. Otherwise a build could stop half-way and
    leave the units of one plan beside the bundle of another.
    """
    if is_forced():
        return
    if not is_same_plan:
        require_own_stage(out_folder)
    if not out_folder.is_begun("bundle"):  # an unfinished bundle has no manifest yet
        require_bundle(out_folder.bundle_dir)
    require_own_bundle(out_folder)
    require_own_report(out_folder)


def require_own_stage(out_folder: OutFolder) -> None:
    """Raise OutputError where the stage phase would replace files that it did not write."""
    folder = out_folder.stage_dir
    if is_forced() or not _files(folder):
        return
    try:
        listed = read_stage_list(folder)
    except OutputError:
        if not out_folder.has_begun("stage"):
            raise refused(folder, _words(folder), "nothing or a stage of this build") from None
        return
    faults = find_damage(folder, listed, since=out_folder.stage_list)
    edited = sorted(path for path, fault in faults.items() if fault in (CHANGED, DOUBTFUL))
    if edited:
        raise OutputError(
            f"{folder / edited[0]}: {faults[edited[0]]}, and the stage must be written again: "
            + or_force(f"save your edits elsewhere ({ADVICE})")
        )


def require_own_bundle(out_folder: OutFolder) -> None:
    """Raise OutputError if OUT/bundle holds files that no bundle phase wrote.

    With --force, a folder that is not a bundle is removed instead.
    """
    folder = out_folder.bundle_dir
    files = _files(folder)
    if is_forced():
        if files and not out_folder.has(folder / MANIFEST):
            out_folder.remove(folder)
        return
    require_bundle(folder)
    if others := find_others(folder):
        raise refused(folder, words_for(others), "a bundle and no other file")


def no_layer(path: Path, *, is_given: bool) -> OutputError:
    """Return the error for a stage that is not a file.

    is_given  whether --stage named the path; otherwise it is OUT's own stage
    """
    found = contents_of(path)
    fault = f"{path} is missing" if found.kind is Kind.NOTHING else f"{path}: found {found.words}"
    remedy = ", expected a USD layer" if is_given else ": run `stereocell stage OUT` first"
    return OutputError(f"{fault}{remedy}")


def require_own_report(out_folder: OutFolder) -> None:
    """Raise OutputError if OUT's report is a page that no report phase wrote."""
    file = out_folder.report_file
    if out_folder.has(file) and not (
        is_sealed_text(file) or out_folder.has_begun("report") or is_forced()
    ):
        raise refused(file, "another page", "nothing or a report of this build")


def require_own_tissue(out_folder: OutFolder) -> None:
    """Raise OutputError if OUT/tissue holds files without the record of `stereocell tissue`."""
    folder = out_folder.out / FOLDER
    if _files(folder) and not out_folder.has(folder / RECORD) and not is_forced():
        raise refused(folder, _words(folder), "nothing or tissue classes of this build")


def _files(folder: Path) -> set[str]:
    """Return the relative paths of the files below a folder, except the operating system's."""
    return {path for path in sizes_of(folder) if not is_ignored(path.rpartition("/")[2])}


def _words(folder: Path) -> str:
    return words_for(sorted(_files(folder)))
