"""Values that an OME-Zarr image states beside its own metadata, compared with these.

- The arrays name their dimensions as well: `dimension_names` of Zarr v3, `_ARRAY_DIMENSIONS` of
  xarray in v2. A permutation of the axes mirrors the specimen, so the user decides.
- bioformats2raw keeps the OME-XML of the file that it converted in `OME/METADATA.ome.xml`.
"""

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from stereocell.model.axes import AXES
from stereocell.model.errors import SourceError
from stereocell.read import ome_xml
from stereocell.read.array_axes import axis_of, given_axes
from stereocell.read.dataset import VoxelArray
from stereocell.read.spacing import Grid, PartialTriple
from stereocell.read.statements import Statement, Subject, Trust, settle
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location, is_own

_XML = "OME/METADATA.ome.xml"
_MAX_BYTES = 64 << 20


def dimension_names(array: Any) -> tuple[str, ...]:
    """Return the names of an array's dimensions, as letters; empty: not stated, or no axes."""
    named = getattr(array.metadata, "dimension_names", None)
    named = named or array.attrs.get("_ARRAY_DIMENSIONS", ())
    listed = tuple(axis_of(str(name)) for name in named) if isinstance(named, list | tuple) else ()
    return listed if listed and set(listed) <= set(AXES) else ()


def settled_axes(
    where: str, array: Any, axes: tuple[str, ...], given: str
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the axes of an image, and notes.

    axes   of the image's metadata
    given  the user's `--axes`, which decides between them and the names of the dimensions

    Raises SourceError where the names are in another order and the user didn't decide.
    """
    named = dimension_names(array)
    is_turned = named != axes and sorted(named) == sorted(axes)
    if is_turned and not given:
        raise SourceError(
            f"{where}: axes: found {', '.join(axes)} in `axes` of the image, and "
            f"{', '.join(named)} in the names of the array's dimensions, expected the same order: "
            f"--axes {''.join(axes)} or --axes {''.join(named)} decides"
        )
    if given:
        return given_axes(where, array.shape, given), ()
    if not named:
        return axes, ()
    settled = settle(
        Subject("axes"),
        [
            Statement(axes, "`axes` of the image"),
            Statement(named, "the names of the array's dimensions", Trust.REPEATED),
        ],
    )
    return axes, settled.notes


@dataclass(frozen=True, slots=True)
class Converted:
    """An image in the OME-XML of the file that was converted.

    spacing_um  (z, y, x), um; None each: not stated
    shape       voxels (z, y, x)
    path        of the OME-XML
    """

    spacing_um: PartialTriple
    shape: tuple[int, int, int]
    path: str


def converted_of(location: Location) -> Converted | None:
    """Return the OME-XML's image beside an image of bioformats2raw on this machine."""
    image = Path(location.source)
    container = image.parent
    path = container / _XML
    if not location.is_local or not path.is_file() or not is_own(path, [container.resolve()]):
        return None
    if path.stat().st_size > _MAX_BYTES:
        return None
    with suppress(SourceError), one_line(str(path), "OME-XML"):
        root = ome_xml.parse(path.read_text(encoding="utf-8", errors="replace"), str(path))
        images = ome_xml.images_of(root, str(path))
        index = _index_of(container, image.name)
        pixels = ome_xml.pixels_of(root, index)
        if pixels is not None and index < len(images):
            return Converted(images[index].spacing_um, _sizes(pixels), str(path))
    return None


def _index_of(container: Path, name: str) -> int:
    """Return the place of an image among the series of its container. Raises ValueError."""
    for file in ("zarr.json", ".zattrs"):
        path = container / "OME" / file
        if path.is_file() and path.stat().st_size <= _MAX_BYTES:
            about: Any = json.loads(path.read_text(encoding="utf-8"))
            about = about.get("attributes", about) if isinstance(about, Mapping) else {}
            listed = about.get("ome", about).get("series")
            if isinstance(listed, list) and name in listed:
                return listed.index(name)
    return int(name)


def _sizes(pixels: ElementTree.Element) -> tuple[int, int, int]:
    z, y, x = (int(pixels.get(f"Size{axis}", 0)) for axis in "ZYX")
    return z, y, x


def settled_spacing(
    grid: Grid, converted: Converted, finest: VoxelArray
) -> tuple[Grid, tuple[str, ...]]:
    """Return the finest level's grid with the spacing of the most trusted field, and notes."""
    name = os.path.join("OME", os.path.basename(converted.path))
    if converted.shape != finest.shape:
        found = " x ".join(map(str, converted.shape))
        return grid, (f"{name} describes {found} voxels (z, y, x): it is not used",)
    if grid.spacing_um is None:
        z, y, x = converted.spacing_um
        if z is None or y is None or x is None:
            return grid, ()
        note = f"voxel spacing: the image states none with a unit of length: {name} is used"
        return Grid(grid.shape, (z, y, x)), (note,)
    notes: list[str] = []
    for axis, own, other in zip("zyx", grid.spacing_um, converted.spacing_um, strict=True):
        if other is None:
            continue
        subject = Subject(
            f"voxel spacing along {axis}", "um", remedy="--spacing-um z,y,x replaces it"
        )
        statements = [Statement(own, "scale"), Statement(other, name, Trust.REPEATED)]
        notes += settle(subject, statements).notes
    return grid, tuple(notes)
