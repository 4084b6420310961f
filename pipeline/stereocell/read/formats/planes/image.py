"""Read a folder of images: planes of TIFF, PNG, JPEG or BMP, or a TIFF stack for each channel.

The file names state which plane, channel and time a file holds: names.py guesses it, or `--pattern`
says it (pattern.py). Wells, sites and series divide the files into separate volumes, of which one
is built. The head of every file is read at once, its pixels when a window needs them.
"""

import re
from contextlib import ExitStack
from dataclasses import replace

from stereocell.model.counted import counted
from stereocell.model.errors import SourceError, UsageError
from stereocell.read.beside import or_one_of, others_in
from stereocell.read.formats.planes.endings import TIFF
from stereocell.read.formats.planes.files import join, read_head
from stereocell.read.formats.planes.listing import list_images, of_one_kind
from stereocell.read.formats.planes.names import guess, in_natural_order
from stereocell.read.formats.planes.of_planes import image_of_planes
from stereocell.read.formats.planes.of_stacks import image_of_stacks
from stereocell.read.formats.planes.pattern import read_by_pattern
from stereocell.read.formats.planes.place import Place
from stereocell.read.formats.planes.volume import groups_of, volume_of
from stereocell.read.formats.planes.volume_files import VolumeFiles
from stereocell.read.formats.tiff.image import read_image as read_tiff
from stereocell.read.formats.tiff.open_file import open_tiff
from stereocell.read.image import Image
from stereocell.read.series import numbers_of
from stereocell.storage.library_errors import collected_log
from stereocell.storage.location import Location


def read_image(location: Location, *, series: int = 0, pattern: str = "") -> Image:
    """Return one volume of the folder; 0 is the largest, others count from 1 as `list_series` does.

    pattern  how the names are built, such as `img_c{c}_z{z}.tif`; empty: guessed

    Raises SourceError where the files don't form a volume, UsageError where the folder lacks the
    series or the pattern fits no file.
    """
    where = location.shown
    listed = in_natural_order(list_images(location))
    whole = None if pattern else _set_in(location, listed)
    if whole is not None:
        return whole
    places, notes = _places(location, listed, pattern)
    if held := others_in(location.source, "planes", "tiff"):
        notes.append(f"the folder also holds {held}, which are not read: name one to build it")
    groups = groups_of(places)
    if series > len(groups):
        raise UsageError(
            f"{where}: --series: found {series}, expected {numbers_of(len(groups))} "
            "(`--series list` shows them)"
        )
    number = series or 1 + max(range(len(groups)), key=lambda index: len(groups[index]))
    chosen = groups[number - 1]
    if len(chosen) == 1 and len(listed) > 1 and not (series or pattern):
        raise SourceError(
            f"{where}: found {len(listed)} images, such as {listed[0]!r:.100} and "
            f"{listed[-1]!r:.100}, expected numbers or words for planes or channels in their "
            "names: name one file, choose by --series (`--series list`), or give --pattern"
        )
    if len(groups) > 1:
        why = "asked for" if series else "the largest"
        notes.append(
            f"{len(groups)} series in the names; building --series {number}, {why}: "
            f"{chosen[0].group}"
        )
    volume = volume_of(where, chosen)
    files = VolumeFiles(location, volume)
    first = read_head(files.path((0, 0, 0)), files.shown((0, 0, 0)))
    if chosen[0].plane is not None and first.pages == 1:
        return image_of_planes(files, notes)
    if first.pages == 1:
        raise SourceError(
            f"{where}: found images of one plane whose names don't count planes, such as "
            f"{chosen[0].path!r:.100}, expected a volume of at least 2 planes: number the files, "
            f"or give --pattern with {{z}}{or_one_of(location.source, 'planes', 'tiff')}"
        )
    if len(volume.planes) > 1:
        raise SourceError(
            f"{where}: found {first.pages} planes in {chosen[0].path!r:.100}, whose name also has "
            "the number of a plane, expected only one of the two"
        )
    return image_of_stacks(files, notes)


def list_series(location: Location) -> tuple[str, ...]:
    """Return a line for each group of files, numbered as for `--series`. Raises SourceError."""
    groups = groups_of(_places(location, in_natural_order(list_images(location)), "")[0])
    return tuple(
        f"{i:3d}  {group[0].group or 'all files'}: {counted(len(group), 'file')}, such as "
        f"{group[0].path!r:.100}"
        for i, group in enumerate(groups, start=1)
    )


def _set_in(location: Location, found: list[str]) -> Image | None:
    """Return the image of a folder with one TIFF stack or an OME-TIFF set; None: another folder.

    The OME-XML combines the files of a set to one image, regardless of their names.
    """
    paths = [path for path in found if path.lower().endswith(TIFF)]
    if not paths or len({path.rpartition("/")[0] for path in paths}) > 1:
        return None
    first = Location(join(location.source, paths[0]), True)
    if len(paths) > 1:
        with ExitStack() as stack, collected_log("tifffile"):
            text = open_tiff(first, stack).pages.first.description
        names = set(re.findall(r'FileName\s*=\s*"([^"]*)"', text))
        if "openmicroscopy" not in text or not ("BinaryOnly" in text or len(names) > 1):
            return None
    elif read_head(first.source, f"{location.shown}/{paths[0]}").pages == 1:
        return None
    image = read_tiff(first)
    return replace(image, notes=(f"the folder is read through {paths[0]}", *image.notes))


def _places(
    location: Location, found: list[str], pattern: str
) -> tuple[tuple[Place, ...], list[str]]:
    """Return the places of the files, and notes on those that are left out."""
    if pattern:
        own = found if "/" in pattern else [path for path in found if "/" not in path]
        places = read_by_pattern(own, pattern)
        left = len(found) - len(places)
        return places, [f"{left} files whose names don't fit the pattern left out"] * (left > 0)
    paths, notes = of_one_kind(found)
    first = read_head(join(location.source, paths[0]), f"{location.shown}/{paths[0]}")
    places = guess(paths, first.pages > 1)
    if 2 * len(places) < len(paths):
        raise SourceError(
            f"{location.shown}: found {len(paths)} images, of which {len(places)} are named "
            f"alike, such as {places[0].path!r:.100}, expected one way of naming: name one of the "
            "files, or describe the names by --pattern"
        )
    if len(places) < len(paths):
        others = len(paths) - len(places)
        are = "files with other names" if others > 1 else "file with another name"
        notes.append(f"{others} {are} left out")
    return places, notes
