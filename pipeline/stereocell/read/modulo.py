"""Angles, wavelengths, lifetimes or phases that OME-XML describes along z, channels or time.

The annotation `ModuloAlongZ` says that several angles are stored along z. The planes of each angle
are an image of their own, never slices of one stack. Wavelengths along C stay channels.

Bio-Formats stores the planes of all angles one after another at each depth; other writers store the
whole stack of each angle. The positions of the planes decide which. Without positions the voxels
decide: neighbouring slices of one stack are more alike.

References: https://docs.openmicroscopy.org/ome-model/latest/developers/6d-7d-and-8d-storage.html
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from stereocell.model.tiling import Box
from stereocell.read import ome_xml
from stereocell.read.dataset import StoredArray, VoxelArray
from stereocell.read.image import Image
from stereocell.read.series import Candidate, candidate, choose

_MOST = 10_000  # values along one axis; an annotation with more is ignored
_LONGEST = 20  # characters of a type or a label that a message shows
_COMPARED = 8  # pairs of planes that are compared to find the order of the values
_PLURALS = {"phase": "phases", "lambda": "wavelengths", "lifetime": "lifetimes"}


@dataclass(frozen=True, slots=True)
class Modulo:
    """A further axis, stored along one of the usual ones.

    axis    `z`, `c` or `t`: the axis along which it is stored
    kind    type, such as `angle`
    labels  one for each value
    """

    axis: str
    kind: str
    labels: tuple[str, ...]

    @property
    def counted(self) -> str:
        """The number of values with their noun, such as `3 angles`."""
        plural = _PLURALS.get(self.kind, f"{self.kind}s")
        return f"{len(self.labels)} {plural if len(self.labels) != 1 else self.kind}"


def modulos_of(root: ElementTree.Element) -> list[Modulo]:
    """Return the further axes of the first image that have more than one value."""
    found = []
    for node in ome_xml.modulos_of(root):
        axis = node.tag.rpartition("}")[2].removeprefix("ModuloAlong").lower()
        kind = _kind(node)
        labels = _labels(node)
        if axis in ("z", "c", "t") and len(labels) > 1:
            found.append(Modulo(axis, kind, labels))
    return found


def _kind(node: ElementTree.Element) -> str:
    """Return the type of a further axis; the type `other` is explained by TypeDescription."""
    stated = [node.get(name, "").strip().lower() for name in ("Type", "TypeDescription")]
    return next((one for one in stated if one not in ("", "other")), "value")[:_LONGEST]


def _labels(node: ElementTree.Element) -> tuple[str, ...]:
    texts = [(child.text or "").strip()[:_LONGEST] for child in node]
    if texts:
        return tuple(texts)
    try:
        start, end = float(node.get("Start", "")), float(node.get("End", ""))
        step = float(node.get("Step", "1"))
    except ValueError:
        return ()
    count = round((end - start) / step) + 1 if step else 0
    if not 1 < count <= _MOST:
        return ()
    unit = node.get("Unit", "").strip()[:10]
    return tuple(f"{start + index * step:g} {unit}".strip() for index in range(count))


def split(where: str, image: Image, root: ElementTree.Element | None, series: int) -> Image:
    """Return one of the images that are stored along further axes, with notes.

    root    root of the OME-XML; None: there is none
    series  from 1, as `candidates` lists them; 0: the first

    Raises UsageError where there is no such image.
    """
    listed = _parts_of(image, root)
    choices = candidates(image, listed)
    index, _ = choose(where, choices, series or 1)
    if root is None:
        return image
    others = [one for one in modulos_of(root) if one not in listed and not _are_channels(one)]
    notes = [
        f"ModuloAlong{one.axis.upper()} states {one.counted}, by which "
        f"{image.arrays[0].size(one.axis)} planes along {one.axis} can't be divided: left as one "
        "image"
        for one in others
    ]
    places = list(product(*(range(len(one.labels)) for one in listed)))[index]
    for one, place in zip(listed, places, strict=True):
        is_interleaved = _is_interleaved(image.arrays[0], one, root)
        count = image.arrays[0].size(one.axis) // len(one.labels)
        image = _part(image, one, place, is_interleaved=is_interleaved)
        order = "alternately" if is_interleaved else "one stack after another"
        shown = f"{count} along {one.axis} each" + (f" ({order})" if count > 1 else "")
        notes.append(
            f"ModuloAlong{one.axis.upper()}: {one.counted}, {shown}: {one.kind} "
            f"{one.labels[place]} is read (--series list shows all)"
        )
    return replace(image, notes=(*image.notes, *notes))


def candidates(image: Image, parts: Sequence[Modulo]) -> list[Candidate]:
    """Return the entry in the list of series of each image that is stored along further axes."""
    sizes = {axis: image.arrays[0].size(axis) for axis in "zct"}
    for one in parts:
        sizes[one.axis] //= len(one.labels)
    _, y, x = image.arrays[0].shape
    found = candidate(
        (sizes["z"], y, x),
        channels=sizes["c"],
        times=sizes["t"],
        spacing_um=image.grids[0].spacing_um,
    )
    named = product(*([f"{one.kind} {label}" for label in one.labels] for one in parts))
    return [Candidate(", ".join([*names, found.label]), found.voxels) for names in named]


def listed(image: Image, root: ElementTree.Element | None) -> list[Candidate]:
    """Return the entries of the images that `split` chooses from."""
    return candidates(image, _parts_of(image, root))


def parts_along(root: ElementTree.Element, sizes: Mapping[str, int]) -> list[Modulo]:
    """Return the further axes of the first image that separate images.

    sizes  lengths of the image along z, c and t
    """
    found = [one for one in modulos_of(root) if not _are_channels(one)]
    return [one for one in found if sizes[one.axis] % len(one.labels) == 0]


def _parts_of(image: Image, root: ElementTree.Element | None) -> list[Modulo]:
    sizes = {axis: image.arrays[0].size(axis) for axis in "zct"}
    return [] if root is None else parts_along(root, sizes)


def _are_channels(one: Modulo) -> bool:
    return one.axis == "c" and one.kind == "lambda"


class PartAlong:
    """Every n-th index of one axis of an array, or a run of them."""

    def __init__(self, array: StoredArray, axis: int, start: int, step: int, count: int) -> None:
        self._array, self._axis, self._start, self._step = array, axis, start, step
        self.shape = (*array.shape[:axis], count, *array.shape[axis + 1 :])
        self.chunks = (*array.chunks[:axis], 1, *array.chunks[axis + 1 :])
        self.dtype = array.dtype

    @property
    def stored(self) -> StoredArray:
        """The array that holds the planes of all values."""
        return self._array

    def stored_spans(self, spans: Sequence[Sequence[range]]) -> list[list[range]]:
        """Return ranges of indices along each axis as ranges of indices of the stored array."""
        found = [list(ranges) for ranges in spans]
        places = [self._start + self._step * at for one in spans[self._axis] for at in one]
        found[self._axis] = [range(place, place + 1) for place in places]
        return found

    def __getitem__(self, key: Any) -> NDArray[Any]:
        wanted = list(key)
        part = wanted[self._axis]
        if isinstance(part, slice):
            first, stop, _ = part.indices(self.shape[self._axis])
            places = [self._start + self._step * at for at in range(first, stop)]
            planes = []
            for place in places:
                wanted[self._axis] = slice(place, place + 1)
                planes.append(np.asarray(self._array[tuple(wanted)]))
            along = sum(isinstance(one, slice) for one in key[: self._axis])
            return np.concatenate(planes, axis=along)
        wanted[self._axis] = self._start + self._step * int(part)
        return np.asarray(self._array[tuple(wanted)])


def _part(image: Image, one: Modulo, place: int, *, is_interleaved: bool) -> Image:
    """Return the image of one value of a further axis."""
    total = image.arrays[0].size(one.axis)
    count = total // len(one.labels)
    start, step = (place, len(one.labels)) if is_interleaved else (place * count, 1)
    arrays = tuple(
        VoxelArray(
            PartAlong(level.array, level.axes.index(one.axis), start, step, count), level.axes
        )
        for level in image.arrays
    )
    grids = tuple(
        replace(grid, shape=array.shape) for grid, array in zip(image.grids, arrays, strict=True)
    )
    found = replace(image, arrays=arrays, grids=grids)
    if one.axis != "c":
        return found
    chosen = [start + step * at for at in range(count)]
    return replace(
        found,
        names=tuple(image.names[at] for at in chosen),
        colors=tuple(image.colors[at] for at in chosen),
    )


def _is_interleaved(array: VoxelArray, one: Modulo, root: ElementTree.Element) -> bool:
    """Return whether the values of a further axis alternate, rather than follow in runs."""
    n = len(one.labels)
    total = array.size(one.axis)
    if total == n:
        return True
    if one.axis == "z":
        places = ome_xml.positions_of(root)
        if len(places) == total:
            alternating = sum(places[at] == places[at + 1] for at in range(0, total, n))
            in_runs = sum(places[at] == places[at + total // n] for at in range(total // n))
            if alternating != in_runs:
                return alternating > in_runs
    firsts = np.linspace(0, total - n - 1, _COMPARED).astype(int)
    near = sum(_difference(array, one.axis, at, at + 1) for at in firsts)
    far = sum(_difference(array, one.axis, at, at + n) for at in firsts)
    return far < near


def _difference(array: VoxelArray, axis: str, first: int, second: int) -> float:
    """Return the mean absolute difference between two planes along an axis."""
    planes = []
    for at in (first, second):
        _, y, x = array.shape
        box = Box((at, 0, 0), (at + 1, y, x)) if axis == "z" else Box((0, 0, 0), (1, y, x))
        time, channel = (at if axis == name else 0 for name in "tc")
        planes.append(array.window(time, channel, box).astype(np.float64))
    return float(np.abs(planes[0] - planes[1]).mean())
