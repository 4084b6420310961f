"""The formats that are read, and which one a source has."""

import os
import zipfile
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import fsspec

from stereocell.model.errors import SourceError, UsageError
from stereocell.read.file_kind import require_kind
from stereocell.read.foreign_files import bare_voxels_words, foreign_words
from stereocell.read.image import Image, printable
from stereocell.storage.archives import ARCHIVE_SUFFIXES
from stereocell.storage.contents import contents_of
from stereocell.storage.first_bytes import SHARED, identify
from stereocell.storage.kinds import Kind
from stereocell.storage.library_errors import library_boundary, one_line
from stereocell.storage.location import ANSWER_S, Location, does_answer, first_bytes, require_own

_SURFACES = (
    *(".gii", ".gii.gz", ".stl", ".obj", ".ply", ".vtp", ".glb", ".gltf", ".3mf"),
    *(".usda", ".usdc", ".usdz"),
)
_PICTURES = (".png", ".jpg", ".jpeg", ".bmp")  # which are planes of a folder
_FOLDERS = ("planes", "dicom")  # formats of folders whose files may have any name
_DICOM_ORDER = (
    "images before phases, projections and localizers, larger series first; then images as "
    "acquired before derived ones, in phase and water before opposed phase and fat, then lower "
    "echo times, b-values and energies"
)
_VOXELS, _HEADERS = (".raw", ".zraw", ".bin"), (".mhd", ".nhdr")  # of MetaImage and NRRD


@dataclass(frozen=True, slots=True)
class Reader:
    """One format: its names, and the module whose `read_image(location) -> Image` reads it.

    title       the format's usual name
    has_series  one source may hold several images: `read_image(location, series=1)`
    order       a sentence on the order of its images; empty: the source's own
    has_pattern names of files tell what they hold: `read_image(location, pattern="a_z{z}.tif")`
    has_axes    a source may not name its axes: `read_image(location, axes="czyx")`
    is_remote   it is read from an address, too
    version     is raised when the same file gives other voxels or another place: a part of the key
                of each result
    """

    module: str
    title: str
    has_series: bool = False
    order: str = ""
    has_pattern: bool = False
    has_axes: bool = False
    is_remote: bool = False
    version: int = 1

    @property
    def name(self) -> str:
        """The title without its part in brackets, for messages."""
        return self.title.partition(" (")[0]

    def read_image(
        self, location: Location, *, series: int = 0, pattern: str = "", axes: str = ""
    ) -> Image:
        """Return the image of a source. Raises UsageError for an option that it doesn't take."""
        given: dict[str, Any] = {}
        for name, value in (("series", series), ("pattern", pattern), ("axes", axes)):
            if getattr(self, f"has_{name}"):
                given[name] = value
            elif value:
                raise _not_taken(location, self, name, str(value))
        # imported on use: each import takes up to 2 s, and a process needs one
        image: Image = import_module(self.module).read_image(location, **given)
        return image


READERS = {
    "ome-zarr": Reader(
        "stereocell.read.formats.ome_zarr.image",
        "OME-Zarr",
        has_series=True,
        has_axes=True,
        is_remote=True,
    ),
    "tiff": Reader(
        "stereocell.read.formats.tiff.image", "TIFF", has_series=True, has_axes=True, is_remote=True
    ),
    "planes": Reader(
        "stereocell.read.formats.planes.image",
        "a folder of TIFF, PNG, JPEG or BMP planes",
        has_series=True,
        has_pattern=True,
    ),
    "dicom": Reader(
        "stereocell.read.formats.dicom.image",
        "DICOM (a file or a folder)",
        has_series=True,
        order=_DICOM_ORDER,
    ),
    "nifti": Reader("stereocell.read.formats.nifti.image", "NIfTI or Analyze"),
    "mgh": Reader("stereocell.read.formats.mgh", "MGH (FreeSurfer)"),
    "ims": Reader("stereocell.read.formats.ims.image", "Imaris"),
    "hdf5": Reader("stereocell.read.formats.hdf5.image", "HDF5 (NAME.h5:/KEY)", has_axes=True),
    "n5": Reader("stereocell.read.formats.n5.image", "N5", has_axes=True, is_remote=True),
    "bdv": Reader("stereocell.read.formats.bdv", "BigDataViewer's XML", has_series=True),
    "nrrd": Reader("stereocell.read.formats.nrrd.image", "NRRD"),
    "metaimage": Reader("stereocell.read.formats.metaimage.image", "MetaImage"),
    "mrc": Reader("stereocell.read.formats.mrc.image", "MRC"),
    "czi": Reader("stereocell.read.formats.czi.image", "CZI", has_series=True),
    "lif": Reader("stereocell.read.formats.lif", "LIF", has_series=True),
    "nd2": Reader("stereocell.read.formats.nd2.image", "ND2", has_series=True),
}
# a file that no reader above knows is given to this one, which takes what bioio's plugins do
OTHER = Reader(
    "stereocell.read.formats.other", "a file for an installed plugin of bioio", has_series=True
)


def format_of(source: str | Path) -> str:
    """Return the format of a source: a key of READERS, or `other`, by its name and first bytes."""
    return Location.of(source).format or "other"


def reader_of(source: str | Path) -> str:
    """Return the dotted name of the module that reads a source."""
    return module_of(format_of(source))


def module_of(format: str) -> str:
    """Return the dotted name of the module that reads a format, as `format_of` gives it."""
    return READERS.get(format, OTHER).module


def reader_version(source: str | Path) -> tuple[str, int]:
    """Return the format of a source, as `format_of` does, and the version of its reader."""
    format = format_of(source)
    return format, READERS.get(format, OTHER).version


def find_reader(source: str | Path) -> tuple[Location, Reader]:
    """Return the place of a source that is there, and the reader of its format."""
    location = Location.of(source)
    if location.is_local and not Path(location.path).exists():
        if os.path.islink(location.path):
            target = os.readlink(location.path)
            raise SourceError(
                f"{location.shown}: a link to {printable(target):.200}, which isn't there, "
                "expected a file or a folder"
            )
        raise SourceError(f"{location.shown}: not found, expected a file or a folder")
    if location.is_local and not Path(location.path).is_dir():
        require_own(location.path, [location.folder], named=location.shown)
    named = location.format
    if location.is_local and (words := foreign_words(location.path, only_other=True)):
        raise SourceError(f"{location.shown}: found {words}, expected a format that is read")
    if named in _FOLDERS:
        _require_no_result(location)
    if named is None and not import_module(OTHER.module).can_read(location):
        raise _unknown(location)
    reader = READERS.get(named or "", OTHER)
    require_kind(location, named or "", reader.name)
    if not location.is_local and not reader.is_remote:
        raise SourceError(
            f"{location.shown}: {reader.title} at an address, expected a path on this machine: "
            "copy it here first"
        )
    if not location.is_local:
        with one_line(location.shown, "an address that fsspec opens"):
            files, path = fsspec.url_to_fs(location.source, **location.storage_options)
        if not does_answer(files, path):
            raise SourceError(
                f"{location.shown}: no answer within {ANSWER_S:g} s, expected a store that is up"
            )
    return location, reader


def _require_no_result(location: Location) -> None:
    """Raise SourceError where a folder is a result of StereoCell: its images look like planes."""
    found = contents_of(Path(location.path))
    if found.kind in (Kind.BUILD, Kind.STAGE, Kind.BUNDLE, Kind.SITE, Kind.PART):
        raise SourceError(
            f"{location.shown}: found {found.words}, expected a volume, such as the one that it "
            "was built from; `stereocell export` writes volumes of a build"
        )


def list_series(source: str | Path) -> tuple[str, ...]:
    """Return a line for each image of a source of several; line i describes `series` = i.

    A line holds modality, orientation, size and spacing, and no description from the files.
    Raises SourceError where the source can't be read, UsageError where it has another format.
    """
    location, reader = find_reader(source)
    if not reader.has_series:
        raise _not_taken(location, reader, "series", "list")
    with library_boundary(location.shown, f"{reader.name} that is whole"):
        lines: tuple[str, ...] = import_module(reader.module).list_series(location)
    return lines


def series_order(source: str | Path) -> str:
    """Return a sentence on the order of `list_series`; empty: that of the source itself."""
    return find_reader(source)[1].order


def _unknown(location: Location) -> SourceError:
    """Return the error of a source of no known format, which says what it is instead."""
    last = location.parts[-1].lower() if location.parts else ""
    found = "unknown format"
    if last.endswith(_SURFACES):
        found = "a surface (mesh), no volume"
    elif header := _header_beside(location):
        return SourceError(
            f"{location.shown}: found the voxels of {printable(header):.200}, expected that file"
        )
    elif location.is_local:
        content = _words_of(Path(location.source))
        if last.endswith(_PICTURES) and content.endswith(" image"):
            return SourceError(
                f"{location.shown}: one plane (2D): found {content}, expected a volume: name the "
                "folder of its planes"
            )
        found += f": found {content}"
    if last.endswith(ARCHIVE_SUFFIXES) and zipfile.is_zipfile(location.path):
        return SourceError(
            f"{location.shown}: found a zip archive without a Zarr group, expected OME-Zarr: unzip "
            "it, and name the file or folder in it"
        )
    formats = ", ".join(reader.title for reader in READERS.values())
    if found.endswith(")"):  # the way out is the message, so the list would hide it
        formats = "OME-Zarr, TIFF, DICOM, NIfTI, HDF5 and others that are read"
    return SourceError(f"{location.shown}: {found}; expected {formats}, or {OTHER.title}")


def _words_of(path: Path) -> str:
    """Return what a path of no known format holds: by its first bytes, else by its name."""
    content = contents_of(path).words
    if not path.is_file():
        return content
    found = identify(first_bytes(str(path)))
    named = foreign_words(path.name)
    if named and (not found.is_known or found.words in SHARED):
        return named
    is_bare = not found.is_known or found.words.startswith("zeros")
    return (is_bare and bare_voxels_words(path)) or content


def _header_beside(location: Location) -> str:
    """Return the name of the header beside a file of bare voxels; empty: there is none."""
    path = Path(location.path)
    if not location.is_local or path.suffix.lower() not in _VOXELS:
        return ""
    beside = (path.with_suffix(suffix) for suffix in _HEADERS)
    return next((header.name for header in beside if header.is_file()), "")


def _not_taken(location: Location, reader: Reader, option: str, value: str) -> UsageError:
    """Return the error of an option that a format doesn't take; it names those that do."""
    takers = [one.title for one in (*READERS.values(), OTHER) if getattr(one, f"has_{option}")]
    return UsageError(
        f"{location.shown}: --{option} {value}: found {reader.title}, expected "
        f"{', '.join(takers)}, or no --{option}"
    )
