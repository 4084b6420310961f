"""Read the OME-XML that bioformats2raw keeps beside the OME-Zarr images of a converted file.

`OME/METADATA.ome.xml` describes the images as OME-TIFF does: voxel sizes, positions of planes, and
further axes (`ModuloAlongZ`). The OME-Zarr metadata only have the sizes. So the OME-XML is compared
with them and read by the code for OME-TIFF.
"""

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from stereocell.model.errors import SourceError
from stereocell.read import ome_xml
from stereocell.read.dataset import VoxelArray
from stereocell.read.ome_depth import settle_depth
from stereocell.read.repeats import load_json
from stereocell.read.spacing import Grid, PartialTriple
from stereocell.read.statements import Statement, Subject, Trust, settle
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location, is_own

_XML = "OME/METADATA.ome.xml"
_MAX_BYTES = 64 << 20
_REMEDY = "--spacing-um z,y,x replaces it"


@dataclass(frozen=True, slots=True)
class Converted:
    """An image in the OME-XML of the file that was converted.

    spacing_um  (z, y, x), um; None for each one not stated
    shape       voxels (z, y, x)
    path        path of the OME-XML
    root        root of the OME-XML, reduced to this image
    """

    spacing_um: PartialTriple
    shape: tuple[int, int, int]
    path: str
    root: ElementTree.Element

    @property
    def name(self) -> str:
        """The path of the OME-XML inside the container, for notes."""
        return os.path.join("OME", os.path.basename(self.path))


def converted_of(location: Location) -> Converted | None:
    """Return the description of an image in the OME-XML beside it; None: there is none.

    Only images on this machine have one.
    """
    image = Path(location.source)
    container = image.parent
    path = container / _XML
    if not location.is_local or not path.is_file() or not is_own(path, [container.resolve()]):
        return None
    if path.stat().st_size > _MAX_BYTES:
        return None
    with suppress(SourceError), one_line(str(path), "OME-XML"):
        root = ome_xml.parse(path.read_text(encoding="utf-8", errors="replace"), str(path))
        root = ome_xml.only_image(root, _index_of(container, image.name))
        pixels = ome_xml.pixels_of(root)
        if pixels is not None:
            images = ome_xml.images_of(root, str(path))
            return Converted(images[0].spacing_um, _sizes(pixels), str(path), root)
    return None


def _index_of(container: Path, name: str) -> int:
    """Return the index of an image in the series of its container. Raises ValueError."""
    for file in ("zarr.json", ".zattrs"):
        path = container / "OME" / file
        if path.is_file() and path.stat().st_size <= _MAX_BYTES:
            about: Any = load_json(path.read_text(encoding="utf-8"), f"OME/{file}")
            about = about.get("attributes", about) if isinstance(about, Mapping) else {}
            listed = about.get("ome", about).get("series")
            if isinstance(listed, list) and name in listed:
                return listed.index(name)
    return int(name)


def _sizes(pixels: ElementTree.Element) -> tuple[int, int, int]:
    z, y, x = (int(pixels.get(f"Size{axis}", 0)) for axis in "ZYX")
    return z, y, x


def settled_grids(
    grids: Sequence[Grid], converted: Converted, finest: VoxelArray
) -> tuple[tuple[Grid, ...], tuple[str, ...]]:
    """Return the levels' grids with the spacing of the most trusted fields, and notes."""
    if converted.shape != finest.shape:
        found = " x ".join(map(str, converted.shape))
        note = f"{converted.name} describes {found} voxels (z, y, x): it is not used"
        return tuple(grids), (note,)
    own = grids[0].spacing_um
    if own is None:
        return _with_spacing_of_xml(grids, converted)
    notes: list[str] = []
    for axis, length, other in zip("yx", own[1:], converted.spacing_um[1:], strict=True):
        if other is not None:
            subject = Subject(f"voxel spacing along {axis}", "um", remedy=_REMEDY)
            repeated = Statement(other, converted.name, Trust.REPEATED)
            notes += settle(subject, [Statement(length, "scale"), repeated]).notes
    stated = [Statement(own[0], "scale")]
    if converted.spacing_um[0] is not None:
        stated.append(Statement(converted.spacing_um[0], converted.name, Trust.REPEATED))
    depth, depth_notes = settle_depth(converted.root, stated)
    ratio = depth / own[0] if depth is not None and own[0] > 0 else 1.0
    return tuple(_deeper(grid, ratio) for grid in grids), (*notes, *depth_notes)


def _with_spacing_of_xml(
    grids: Sequence[Grid], converted: Converted
) -> tuple[tuple[Grid, ...], tuple[str, ...]]:
    z, y, x = converted.spacing_um
    stated = [] if z is None else [Statement(z, f"PhysicalSizeZ of {converted.name}")]
    depth, notes = settle_depth(converted.root, stated)
    if depth is None or y is None or x is None:
        return tuple(grids), ()
    note = f"voxel spacing: the image states no length with a unit: {converted.name} is used"
    return (Grid(grids[0].shape, (depth, y, x)), *grids[1:]), (note, *notes)


def _deeper(grid: Grid, ratio: float) -> Grid:
    """Return a grid whose spacing along z is multiplied by a ratio."""
    if grid.spacing_um is None or ratio == 1.0:
        return grid
    z, y, x = grid.spacing_um
    return replace(grid, spacing_um=(z * ratio, y, x))
