"""Choose which image of an OME-XML is read, and how `--series` counts the images.

A label or an overview may come before the volume. Each level of a pyramid may be a separate image,
and a set of files may hold one position each. So the largest volume of the opened file is read.
"""

import math
import os
from dataclasses import dataclass
from xml.etree import ElementTree

from stereocell.read import ome_xml
from stereocell.read.modulo import parts_along
from stereocell.read.series import Candidate, candidate, choose
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location


@dataclass(frozen=True, slots=True)
class Chosen:
    """One image of an OME-XML.

    root    root with only this image
    series  number of the part along its further axes, from 1; 0: the first
    notes   notes on the choice
    others  number of planes of the other images in the opened file
    """

    root: ElementTree.Element
    series: int
    notes: tuple[str, ...] = ()
    others: int = 0


@dataclass(frozen=True, slots=True)
class _Entry:
    """One line of the list: an image, or a part of it along a further axis."""

    root: ElementTree.Element
    image: int
    part: int
    candidate: Candidate
    is_here: bool


def choose_image(location: Location, root: ElementTree.Element, series: int) -> Chosen:
    """Return the image of an OME-XML with a number in `list_images`; 0: the largest.

    Raises SourceError for OME-XML that can't be read, UsageError where there is no such series.
    """
    where, count = location.shown, ome_xml.count_images(root)
    if count < 2:
        return Chosen(root, series)
    with one_line(where, "an OME-XML with whole numbers as sizes"):
        entries = _entries(location, root)
    index, notes = choose(where, [one.candidate for one in entries], series)
    here = [n for n, one in enumerate(entries) if one.is_here and one.candidate.voxels]
    if not series and here:
        index = max(here, key=lambda n: (entries[n].candidate.voxels, -n))
        is_all = all(one.is_here for one in entries)
        why = "the largest" if is_all else "the largest in this file"
        label = entries[index].candidate.label
        notes = (f"{count} images; building --series {index + 1}, {why}: {label}",)
    chosen = entries[index]
    found = {one.image: one for one in entries if one.is_here and one.image != chosen.image}
    others = sum(_planes(one.root) for one in found.values())
    return Chosen(chosen.root, chosen.part, notes, others)


def list_images(location: Location, root: ElementTree.Element) -> list[Candidate]:
    """Return the entry in the list of series of each image and of its parts along further axes."""
    return [one.candidate for one in _entries(location, root)]


def _entries(location: Location, root: ElementTree.Element) -> list[_Entry]:
    found = []
    for image in range(ome_xml.count_images(root)):
        own = ome_xml.only_image(root, image)
        pixels = ome_xml.pixels_of(own)
        if pixels is None:
            continue
        sizes = {axis: int(pixels.get(f"Size{axis}", 1)) for axis in "ZYXCT"}
        parts = parts_along(own, {axis: sizes[axis.upper()] for axis in "zct"})
        for one in parts:
            sizes[one.axis.upper()] //= len(one.labels)
        z, y, x = ome_xml.images_of(own, location.shown)[0].spacing_um
        label = candidate(
            (sizes["Z"], sizes["Y"], sizes["X"]),
            channels=sizes["C"],
            times=sizes["T"],
            spacing_um=None if z is None or y is None or x is None else (z, y, x),
        )
        is_here = _is_here(location, own)
        for part in range(math.prod(len(one.labels) for one in parts)):
            found.append(_Entry(own, image, part + 1, label, is_here))
    return found


def _is_here(location: Location, root: ElementTree.Element) -> bool:
    """Return whether planes of the first image lie in the opened file."""
    own = os.path.basename(location.parts[-1])
    for _, uuid in ome_xml.tiff_data_of(root):
        if uuid is None or uuid.text == root.get("UUID") or uuid.get("FileName") == own:
            return True
    return False


def _planes(root: ElementTree.Element) -> int:
    pixels = ome_xml.pixels_of(root)
    if pixels is None:
        return 0
    total = math.prod(int(pixels.get(f"Size{axis}", 1)) for axis in "ZCT")
    return total // ome_xml.samples_of(pixels)
