"""Compare an OME-Zarr image's own metadata with values that are stated beside them.

The arrays name their dimensions as well: `dimension_names` of Zarr v3, `_ARRAY_DIMENSIONS` of
xarray in v2. Reading axes in the wrong order mirrors the specimen, so the user decides between
contradictory orders. The OME-XML of a converted file is compared in bioformats2raw.py.
"""

import re
from collections.abc import Mapping
from typing import Any

from stereocell.model.axes import AXES
from stereocell.model.errors import SourceError
from stereocell.read.array_axes import given_axes
from stereocell.read.axis_names import axes_of_names
from stereocell.read.statements import Statement, Subject, Trust, settle

_OF_ZARR_V2 = ("0.1", "0.2", "0.3", "0.4")
_VERSION = re.compile(r"0\.\d")


def dimension_names(array: Any) -> tuple[str, ...]:
    """Return the axes that an array's dimensions are named after; empty: not stated, or others."""
    named = getattr(array.metadata, "dimension_names", None)
    named = named or array.attrs.get("_ARRAY_DIMENSIONS", ())
    is_list = isinstance(named, list | tuple)
    listed = axes_of_names([str(name) for name in named]) if is_list else ()
    return listed if listed and set(listed) <= set(AXES) else ()


def version_notes(ome: Mapping[str, Any], zarr_format: int) -> tuple[str, ...]:
    """Return a note if two fields state different versions, or the files have another version.

    ome          attributes of the group, with one image
    zarr_format  2 or 3, of the files: OME-Zarr up to 0.4 uses Zarr v2, later versions v3
    """
    places = [("the image", ome["multiscales"][0]), ("the group", ome)]
    stated = [
        Statement(str(table["version"]), f"`version` of {name}", trust)
        for (name, table), trust in zip(places, (Trust.STATED, Trust.REPEATED), strict=True)
        if table.get("version")
    ]
    if not stated:
        return ()
    settled = settle(Subject("version of OME-Zarr"), stated)
    version = str(settled.value)
    of_files = 2 if version in _OF_ZARR_V2 else 3
    if zarr_format == of_files or not _VERSION.match(version):
        return settled.notes
    note = (
        f"version of OME-Zarr: {version:.20} is stated, which uses Zarr v{of_files}, but the "
        f"files are Zarr v{zarr_format}: they are read as stored"
    )
    return (*settled.notes, note)


def settled_axes(
    where: str, array: Any, axes: tuple[str, ...], given: str
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the axes of an image, and notes.

    axes   axes in the image's metadata
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
