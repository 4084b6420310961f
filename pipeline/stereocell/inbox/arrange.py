"""Turn the files of an upload into a source that a reader can open: unpacked, with neutral names.

source/specimen.nii.gz      a single file
source/dicom/000001.dcm     DICOM files
source/planes/x_z01.tif     images of planes
source/specimen.ome.zarr/   a Zarr group
"""

import shutil
from collections.abc import Sequence
from pathlib import Path

from stereocell.inbox.limits import InboxLimits
from stereocell.inbox.names import Parts, is_of_system
from stereocell.inbox.refused import RefusedError
from stereocell.inbox.safe_names import NAME, are_planes, ending_of, group_names, plane_names
from stereocell.inbox.unpack import Unpacked, holds_zarr, is_archive, is_zip, unpack
from stereocell.inbox.upload import Upload
from stereocell.read.known_formats import OTHER, find_format, identify
from stereocell.read.known_formats import known_formats as formats_of
from stereocell.storage.first_bytes import HEAD_BYTES
from stereocell.storage.location import Location

SOURCE = "source"
_UNPACKED = "unpacked"
_DICOM, _DICOM_ENDINGS, _INDEX = "dicom", (".dcm", ".dicom", ".ima"), "dicomdir"
_HEADERS = (".mhd", ".nhdr", ".xml", ".xmf", ".companion.ome")  # text files that name other files
_HEADER_BYTES = 1 << 20  # bytes, largest header in which names are replaced
_ONE_BY_ONE = "expected one specimen: upload them one by one"


def arrange(folder: str, limits: InboxLimits) -> str:
    """Arrange a complete upload; return the file or folder to open, relative to `folder`.

    Links or copies the files into `source`, and removes an earlier arrangement. Raises
    RefusedError.
    """
    root = Path(folder)
    upload = Upload.open(root)
    if upload is None:
        raise RefusedError(410, "the upload was deleted: upload the files again")
    for name in (SOURCE, _UNPACKED):
        shutil.rmtree(root / name, ignore_errors=True)
    names = upload.announced.parts
    files = [
        Unpacked(parts, upload.part(index))
        for index, parts in enumerate(names)
        if not is_of_system(parts)
    ]
    if not files:
        raise RefusedError(415, "found only files that operating systems add, expected an image")
    archives = [one for one in files if is_archive(one.path, one.parts[-1])]
    if archives and len(files) > 1 and len(archives) == len(files):
        raise RefusedError(415, f"found {len(archives)} archives, {_ONE_BY_ONE}")
    if len(files) == 1 and archives:
        (archive,) = files
        if is_zip(archive.path) and holds_zarr(archive.path, limits):
            ending = ".ozx" if archive.parts[-1].lower().endswith(".ozx") else ".zarr.zip"
            return _place(root, [((f"{NAME}{ending}",), archive.path)])
        files = unpack(archive.path, root / _UNPACKED, limits)
        if not files:
            raise RefusedError(415, "archive: found no file, expected an image")
    return _arrange(root, files)


def _arrange(root: Path, files: Sequence[Unpacked]) -> str:
    names, paths = [one.parts for one in files], [one.path for one in files]
    if (group := group_names(names)) is not None:
        return _place(root, list(zip(group, paths, strict=True)), group[0][0])
    if len(files) == 1:
        return _place(root, [((NAME + ending_of(names[0][-1]),), paths[0])])
    if dicom := _files_of_dicom(files):
        numbered = [((_DICOM, f"{i:06d}.dcm"), one.path) for i, one in enumerate(dicom, start=1)]
        return _place(root, numbered, _DICOM)
    if are_planes(names):
        planes = [("planes", *parts) for parts in plane_names(names)]
        return _place(root, list(zip(planes, paths, strict=True)), "planes")
    return _arrange_set(root, files)


def _files_of_dicom(files: Sequence[Unpacked]) -> list[Unpacked]:
    """Return the DICOM files, in the order of their names; none if the upload is not DICOM.

    It is DICOM if a file begins with DICOM's mark, or if all files have a DICOM ending.
    """
    marked, loose = [], []
    for one in sorted(files, key=lambda one: one.parts):
        if one.parts[-1].lower() == _INDEX:
            continue
        with one.path.open("rb") as file:
            found = identify(file.read(HEAD_BYTES))
        if found.format == _DICOM:
            marked.append(one)
        elif one.parts[-1].lower().endswith(_DICOM_ENDINGS) and not found.is_known:
            loose.append(one)  # DICOM files from before 1993 lack the mark
    return [*marked, *loose] if marked or len(loose) == len(files) else []


def _arrange_set(root: Path, files: Sequence[Unpacked]) -> str:
    """Arrange files that name each other: a header beside its data."""
    is_listed = any(".ome.tif" in one.parts[-1].lower() for one in files)
    stems: dict[str, str] = {}
    placed = []
    renamed: dict[str, str] = {}
    for one in files:
        ending = ending_of(one.parts[-1])
        stem = one.parts[-1][: len(one.parts[-1]) - len(ending)]
        safe = stems.setdefault(stem, NAME if not stems else f"{NAME}{len(stems) + 1}") + ending
        if is_listed:  # OME-TIFF files list each other in XML that can't be rewritten
            safe = one.parts[-1]
        if safe in renamed.values():
            raise RefusedError(415, f"found several images of the same name, {_ONE_BY_ONE}")
        renamed[one.parts[-1]] = safe
        placed.append(((SOURCE, safe), one.path))
    _place(root, placed)
    for safe in renamed.values():
        _rewrite(root / SOURCE / SOURCE / safe, renamed)
    return f"{SOURCE}/{SOURCE}/{_main_of([*renamed.values()], root / SOURCE / SOURCE)}"


def _rewrite(path: Path, renamed: dict[str, str]) -> None:
    """Replace the old names of files in a header by the new ones."""
    if not path.name.lower().endswith(_HEADERS) or path.stat().st_size > _HEADER_BYTES:
        return
    content = path.read_bytes()
    for name in sorted(renamed, key=len, reverse=True):
        content = content.replace(name.encode(), renamed[name].encode())
    path.unlink()  # the path may be a link to the upload's own file, which must not change
    path.write_bytes(content)


def _main_of(names: Sequence[str], folder: Path) -> str:
    """Return the file of a set that is opened: a header, or the only image of a known format."""
    headers = [name for name in names if name.lower().endswith(_HEADERS)]
    if len(headers) == 1:
        return headers[0]
    ome = sorted(name for name in names if ".ome.tif" in name.lower())
    if ome:
        return ome[0]
    known = []
    for name in names:
        found = find_format(Location.of(folder / name))
        if found is not None and found.name != OTHER:
            known.append(name)
    stems = {name.rpartition(".")[0] for name in known}
    if not known:
        titles = sorted({one.short_title for one in formats_of().values()})
        raise RefusedError(
            415, f"found {len(names)} files of no known format, expected {', '.join(titles[:12])}"
        )
    if len(stems) > 1:
        raise RefusedError(415, f"found {len(known)} images, {_ONE_BY_ONE}")
    return sorted(known)[0]


def _place(root: Path, placed: Sequence[tuple[Parts, Path]], main: str = "") -> str:
    """Put files at their places below `source`; return the path to open: `main`, or the first one.

    Files are linked, not moved, so that the upload can be arranged again.
    """
    for parts, path in placed:
        target = (root / SOURCE).joinpath(*parts)
        target.parent.mkdir(parents=True, exist_ok=True)
        try:
            target.hardlink_to(path)
        except OSError:
            shutil.copyfile(path, target)
    return f"{SOURCE}/{main or '/'.join(placed[0][0])}"
