"""Find the reader of a source, and check that the source exists and has that reader's format."""

import os
from pathlib import Path
from typing import Any

import fsspec

from stereocell.model.errors import SourceError, UsageError
from stereocell.read.file_kind import require_kind
from stereocell.read.foreign_files import bare_voxels_words, foreign_words
from stereocell.read.format import Format
from stereocell.read.image import Image, printable
from stereocell.read.known_formats import OTHER, find_format, identify, known_formats
from stereocell.storage.contents import contents_of
from stereocell.storage.first_bytes import SHARED
from stereocell.storage.kinds import Kind
from stereocell.storage.library_errors import library_boundary, one_line
from stereocell.storage.location import ANSWER_S, Location, does_answer, first_bytes, require_own

_SURFACES = (
    *(".gii", ".gii.gz", ".stl", ".obj", ".ply", ".vtp", ".glb", ".gltf", ".3mf"),
    *(".usda", ".usdc", ".usdz"),
)
_PICTURES = (".png", ".jpg", ".jpeg", ".bmp")  # images in a folder may be the planes of a volume
# endings of MetaImage's and NRRD's separate files of voxels, and of the headers beside them
_VOXELS, _HEADERS = (".raw", ".zraw", ".bin"), (".mhd", ".nhdr")


def read_image(
    location: Location, format: Format, *, series: int = 0, pattern: str = "", axes: str = ""
) -> Image:
    """Return the image of a source.

    Raises UsageError for an option that its format doesn't accept, and SourceError where a library
    is missing or the source can't be read.
    """
    given: dict[str, Any] = {}
    for name, value in (("series", series), ("pattern", pattern), ("axes", axes)):
        if getattr(format, f"has_{name}"):
            given[name] = value
        elif value:
            raise _not_taken(location, format, name, str(value))
    format.require_library(location)
    return format.open(location, **given)


def require_found(location: Location) -> None:
    """Raise SourceError if a path of this machine does not exist."""
    if location.is_local and not Path(location.path).exists():
        if os.path.islink(location.path):
            target = os.readlink(location.path)
            raise SourceError(
                f"{location.shown}: a link to {printable(target):.200}, which doesn't exist, "
                "expected a file or a folder"
            )
        raise SourceError(f"{location.shown}: not found, expected a file or a folder")


def find_reader(source: str | Path) -> tuple[Location, Format]:
    """Return the place and the format of a source. Raises SourceError where there is none."""
    location = Location.of(source)
    require_found(location)
    if location.is_local and not Path(location.path).is_dir():
        require_own(location.path, [location.folder], named=location.shown)
    if location.is_local and (words := foreign_words(location.path, only_other=True)):
        raise SourceError(f"{location.shown}: found {words}, expected a format that is read")
    format = find_format(location) or _other_format(location)
    if location.inside and not format.has_parts:
        raise SourceError(f"{location.shown}: not found, expected a file or a folder")
    if not format.folder_endings and os.path.isdir(location.path):
        _require_no_result(location)
    require_kind(location, format)
    if not location.is_local and not format.is_remote:
        raise SourceError(
            f"{location.shown}: {format.title} at an address, expected a path on this machine: "
            "copy it here first"
        )
    if not location.is_local:
        with one_line(location.shown, "an address that fsspec opens"):
            files, path = fsspec.url_to_fs(location.source, **location.storage_options)
        if not does_answer(files, path):
            raise SourceError(
                f"{location.shown}: no answer within {ANSWER_S:g} s, expected a store that is up"
            )
    return location, format


def _other_format(location: Location) -> Format:
    """Return the format of other files, if it accepts this one. Raises SourceError."""
    other = known_formats()[OTHER]
    if other.may_hold is None or not other.may_hold(location):
        raise _unknown(location)
    return other


def _require_no_result(location: Location) -> None:
    """Refuse a folder that is a result of StereoCell, since its images look like planes.

    Raises SourceError.
    """
    found = contents_of(Path(location.path))
    if found.kind in (Kind.BUILD, Kind.STAGE, Kind.BUNDLE, Kind.SITE, Kind.PART):
        raise SourceError(
            f"{location.shown}: found {found.words}, expected a volume, such as the one that it "
            "was built from; `stereocell export` writes volumes of a build"
        )


def list_series(source: str | Path) -> tuple[str, ...]:
    """Return a line for each image of a source that holds several; line i describes `series` = i.

    A line shows modality, orientation, size and spacing, and none of the file's own descriptions.
    Raises SourceError where the source can't be read, UsageError where its format has one image.
    """
    location, format = find_reader(source)
    if format.list_series is None:
        raise _not_taken(location, format, "series", "list")
    format.require_library(location)
    with library_boundary(location.shown, f"a complete source ({format.short_title})"):
        return format.list_series(location)


def series_order(source: str | Path) -> str:
    """Return a sentence on the order of `list_series`; empty: the order of the source itself."""
    return find_reader(source)[1].order


def _unknown(location: Location) -> SourceError:
    """Return the error for a source of unknown format, with a description of the content."""
    last = location.parts[-1].lower() if location.parts else ""
    found = "unknown format"
    if last.endswith(_SURFACES):
        found = "a surface (mesh), not a volume"
    elif header := _header_beside(location):
        return SourceError(
            f"{location.shown}: found the voxels that {printable(header):.200} describes, expected "
            "that header file"
        )
    elif location.is_local:
        content = _words_of(Path(location.source))
        if last.endswith(_PICTURES) and content.endswith(" image"):
            return SourceError(
                f"{location.shown}: one plane (2D): found {content}, expected a volume: name the "
                "folder of its planes"
            )
        found += f": found {content}"
    formats = ", ".join(one.title for one in known_formats().values() if one.name != OTHER)
    # the text in brackets is the remedy; a long list of formats would hide it
    if found.endswith(")"):
        formats = "OME-Zarr, TIFF, DICOM, NIfTI, HDF5 and others that are read"
    return SourceError(
        f"{location.shown}: {found}, expected {formats}, or {known_formats()[OTHER].title}"
    )


def _words_of(path: Path) -> str:
    """Return a description of a path of unknown format, by its first bytes or its name."""
    content = contents_of(path).words
    if not path.is_file():
        return content
    found = identify(first_bytes(str(path)))
    named = foreign_words(path.name)
    if named and (not found.is_known or found.words in SHARED):
        return named
    is_bare = not found.is_known or found.words.startswith("zeros")
    if words := is_bare and bare_voxels_words(path):
        return words
    return found.words if found.format or not found.is_known else content


def _header_beside(location: Location) -> str:
    """Return the name of the header beside a file of raw voxels; empty: there is none."""
    path = Path(location.path)
    if not location.is_local or path.suffix.lower() not in _VOXELS:
        return ""
    beside = (path.with_suffix(suffix) for suffix in _HEADERS)
    return next((header.name for header in beside if header.is_file()), "")


def _not_taken(location: Location, format: Format, option: str, value: str) -> UsageError:
    """Return the error for an option that a format doesn't accept; it lists formats that do."""
    formats = sorted(known_formats().values(), key=lambda one: one.name == OTHER)
    takers = [one.title for one in formats if getattr(one, f"has_{option}")]
    return UsageError(
        f"{location.shown}: --{option} {value}: found {format.title}, expected "
        f"{', '.join(takers)}, or no --{option}"
    )
