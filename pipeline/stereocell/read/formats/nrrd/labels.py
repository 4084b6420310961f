"""Read the labels of a NRRD's axes, which may name another order than x, y, z, fastest first.

A label is free text, so it counts only if read/axis_names.py recognises an axis in it. In a
patient's space, `space directions` place the axes, and labels are compared with them.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.read.array_axes import with_assumed
from stereocell.read.axis_names import axes_of_names
from stereocell.read.statements import Statement, Subject, Trust, settle

_OF_SPACE = tuple("xyz")


def labelled_axes(fields: Mapping[str, Any], sizes: Sequence[int]) -> tuple[str, ...]:
    """Return an axis for each label, fastest first: t, c, z, y or x.

    A label that means none of them stays, in lower case. The result is empty if no label names an
    axis of space, or if two labels name the same one.
    """
    labels = [str(label).strip(' "') for label in fields.get("labels", ())][: len(sizes)]
    axes = axes_of_names(labels)
    named = [axis for axis in axes if axis in _OF_SPACE]
    is_list = len(labels) == len(sizes) and bool(named) and len(set(named)) == len(named)
    return axes if is_list else ()


def names_by_labels(
    axes: Sequence[str], labelled: Sequence[str], sizes: Sequence[int]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the axes of a stack as the labels name them, and notes.

    axes      i, j, k for space, t, c or others, fastest first
    labelled  result of `labelled_axes`; empty: no labels

    Without labels the axes i, j, k are x, y, z. An axis keeps the name of its label; the others are
    assumed in this order.
    """
    plain = tuple(dict(zip("ijk", "xyz", strict=True)).get(axis, axis) for axis in axes)
    if not labelled:
        return plain, ()
    kept = [
        own if axis not in tuple("ijk") else named if named in _OF_SPACE else ""
        for axis, own, named in zip(axes, plain, labelled, strict=True)
    ]
    spatial = [place for place, axis in enumerate(axes) if axis in tuple("ijk")]
    slowest_first = spatial[::-1]
    found = with_assumed(
        [kept[place] for place in slowest_first], [sizes[place] for place in slowest_first]
    )
    if not found:
        return plain, ()
    names = list(plain)
    for place, axis in zip(slowest_first, found, strict=True):
        names[place] = axis
    if tuple(names) == plain:
        return plain, ()
    shown = ", ".join(names[place] for place in spatial)
    return tuple(names), (f"order of the axes: {shown}, fastest first, by the header's labels",)


def notes_beside_directions(
    labelled: Sequence[str], affine: NDArray[np.float64]
) -> tuple[str, ...]:
    """Return a note if labels name another order of axes than the directions.

    labelled  labels of the axes of space, fastest first; empty: no labels
    affine    (4, 4), from voxels to the patient

    The labels x, y, z in this order may just name the stored axes, and need no note.
    """
    if sorted(labelled) != sorted(_OF_SPACE) or tuple(labelled) == _OF_SPACE:
        return ()
    along = tuple("xyz"[index] for index in np.abs(affine[:3, :3]).argmax(axis=0))
    stated = [
        Statement(along, "space directions"),
        Statement(tuple(labelled), "labels", Trust.REPEATED),
    ]
    return settle(Subject("axes of space, fastest first"), stated).notes
