"""Hold a file to be what its name says, before a reader's library is asked.

A pointer of Git LFS, an HTML page, a copy that did not finish: a library tells of these in words
about its format, each in its own. Here they are said once, for all formats.
"""

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from stereocell.model.errors import SourceError
from stereocell.read.foreign_files import foreign_words
from stereocell.storage.first_bytes import Content, identify, unpacked
from stereocell.storage.location import Location

_HEAD = 1 << 13  # bytes; a gzip file's own header may be long
_USER_BLOCKS = tuple(512 << k for k in range(12))  # before HDF5's own first byte
_HDF5 = b"\x89HDF\r\n\x1a\n"
_OLD_ND2 = b"\0\0\0\x0cjP  "  # before 2006, in JPEG 2000
_FOLDERS = ("ome-zarr", "n5")
# of a format that is recognised, the ending by which it is read
_ENDINGS = {
    "dicom": ".dcm", "tiff": ".tif", "hdf5": ".h5", "nrrd": ".nrrd", "czi": ".czi", "nd2": ".nd2",
    "lif": ".lif", "nifti": ".nii", "nifti.gz": ".nii.gz", "mrc": ".mrc", "mrc.gz": ".mrc.gz",
    "metaimage": ".mha",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Kind:
    """What a format's files begin with.

    formats    of `identify` that are taken
    may_begin  whether a file of this path and head may be of the format although it has no mark
    """

    formats: tuple[str, ...]
    may_begin: Callable[[str, bytes], bool] = lambda _path, _head: False


def _is_hdf5_behind_a_block(path: str, _: bytes) -> bool:
    """Whether HDF5 begins behind a block of the user's own (MATLAB 7.3 has one of 512 bytes)."""
    with open(path, "rb") as file:
        for place in _USER_BLOCKS:
            file.seek(place)
            found = file.read(len(_HDF5))
            if found == _HDF5:
                return True
            if not found:
                break
    return False


def _is_other(_: str, head: bytes) -> bool:
    """Whether the content is unknown: of a format that has no mark, or not in all its files."""
    return not identify(head).is_known


def _may_be_mrc(path: str, head: bytes) -> bool:
    """As `_is_other`, and what is packed by bzip2."""
    return _is_other(path, head) or head.startswith(b"BZh")


def _may_be_text(_: str, head: bytes) -> bool:
    """Whether it may be a header of text that begins as none is known to."""
    content = identify(head)
    return not content.is_known or content.words == "a text file"


_HDF5_KIND = _Kind(("hdf5",), _is_hdf5_behind_a_block)
_KINDS = {
    "tiff": _Kind(("tiff",)),
    "nifti": _Kind(("nifti",), _is_other),  # Analyze has no mark
    "mgh": _Kind((), _is_other),  # MGH has no mark
    "ims": _HDF5_KIND,
    "hdf5": _HDF5_KIND,
    "nrrd": _Kind(("nrrd",), lambda _, head: head.startswith(b"NRRD")),
    "metaimage": _Kind(("metaimage",), _may_be_text),
    "mrc": _Kind(("mrc", "mrc.gz"), _may_be_mrc),  # before 2000 it had no mark
    "czi": _Kind(("czi",)),
    "lif": _Kind(("lif",)),
    "nd2": _Kind(("nd2",), lambda _, head: head.startswith(_OLD_ND2)),
    "dicom": _Kind(("dicom",), _is_other),  # files of before 1993 have no mark
}
_PACKED = ("nifti", "mgh")  # formats whose packed files are told by what is in them
_PAIRED, _COMPANION = (".img", ".img.gz"), ".companion.ome"


def require_kind(location: Location, format_name: str, title: str) -> None:
    """Raise SourceError where a file on this machine is not of the format that its name says.

    title  of the format, as `NIfTI or Analyze`

    Folders, and files that can't be opened, are left to the reader.
    """
    if not location.is_local or not os.path.isfile(location.path):
        return
    path, name = location.path, location.parts[-1].lower()
    try:
        with open(path, "rb") as file:
            head = file.read(_HEAD)
    except OSError:
        return
    if name.endswith(".rec") and (header := _par_beside(Path(path))):
        raise SourceError(
            f"{location.shown}: found the voxels of a Philips PAR/REC pair, beside "
            f"{header!r:.100}, expected an MRC or CCP4 file: make NIfTI of the pair by dcm2niix"
        )
    content, kind = identify(head), _KINDS.get(format_name)
    if format_name == "ome-zarr" and location.is_zarr_archive:
        return
    if format_name in _FOLDERS:
        raise SourceError(
            f"{location.shown}: found a file ({content.words}), expected a folder of {title}"
        )
    if kind is None or name.endswith(_PAIRED):  # the voxels of a pair may begin as anything does
        return
    if name.endswith(_COMPANION):
        title, is_sound = "OME-XML", content.words == "an XML file"
    elif format_name in _PACKED and name.endswith((".gz", ".mgz")):
        title = f"{title}, packed by gzip"
        inside = unpacked(head) if head.startswith(b"\x1f\x8b") else None
        within = identify(inside) if inside else None
        is_sound = within is not None and (within.format in kind.formats or not within.is_known)
    else:
        is_sound = content.format in kind.formats or kind.may_begin(path, head)
    if not is_sound:
        raise _refused(location, content, title)


def _par_beside(path: Path) -> str:
    """Return the name of the header of Philips beside a .rec; empty: there is none."""
    names = (path.with_suffix(suffix).name for suffix in (".PAR", ".par"))
    return next((name for name in names if path.with_name(name).is_file()), "")


def _refused(location: Location, content: Content, title: str) -> SourceError:
    words = content.words
    if not content.is_known:  # the name may say more than bytes without a mark
        words = foreign_words(location.parts[-1]) or words
    ending = _ENDINGS.get(content.format)
    remedy = f": if that is what it is meant to be, name it {ending}" if ending else ""
    return SourceError(f"{location.shown}: found {words}, expected {title}{remedy}")
