"""Values that an OME-Zarr image states beside its own metadata, compared with these.

The arrays name their dimensions as well: `dimension_names` of Zarr v3, `_ARRAY_DIMENSIONS` of
xarray in v2. A permutation of the axes mirrors the specimen, so the user decides. The OME-XML of a
converted file is compared in bioformats2raw.py.
"""

from typing import Any

from stereocell.model.axes import AXES
from stereocell.model.errors import SourceError
from stereocell.read.array_axes import axis_of, given_axes
from stereocell.read.statements import Statement, Subject, Trust, settle


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
