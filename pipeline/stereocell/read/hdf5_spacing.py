"""The voxel spacing and the directions of an HDF5 dataset's axes, by everything that states them.

Positions along a dimension (read/hdf5_dimensions.py) go before attributes, since they are written
plane by plane; attributes of the dataset go before those of a group around it. Positions that
descend turn their axis round: stored as they are, the volume would be its mirror image.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import h5py
import numpy as np

from stereocell.read.array_spacing import ATTRIBUTES, stated_spacings
from stereocell.read.coordinates import Steps, steps_of
from stereocell.read.hdf5_dimensions import Described
from stereocell.read.hdf5_tree import Hdf5Array, Hdf5Tree
from stereocell.read.spacing import PartialTriple, um_per
from stereocell.read.statements import Statement, Subject, Trust, settle
from stereocell.read.value_scale import ATTRIBUTES as PACKING
from stereocell.read.value_scale import scaled

_MAX_POSITIONS = 1_000_000  # longest list of positions that is read


@dataclass(frozen=True, slots=True)
class SettledSpacing:
    """The spacing (z, y, x), um, None where it is not stated, and the axes that run backwards.

    hint  steps of positions that have no unit of length, for the message about a missing spacing
    """

    spacing_um: PartialTriple
    flips: tuple[bool, ...]
    notes: tuple[str, ...]
    hint: str = ""


def settle_spacing(
    tree: Hdf5Tree, dataset: h5py.Dataset, axes: Sequence[str], described: Sequence[Described]
) -> SettledSpacing:
    """Return the spacing of a dataset and the directions of its axes, with notes.

    axes  of the dataset, slowest first
    """
    notes: list[str] = []
    hints: list[str] = []
    flips = [False] * len(axes)
    stated: dict[str, list[Statement]] = {axis: [] for axis in "zyx"}
    for one in described:
        for place, axis in enumerate(axes):
            scale, step = (parts[place] if parts else None for parts in (one.scales, one.steps))
            if axis not in stated:
                continue
            if scale is not None:
                found = _Positions(tree, scale, dataset.shape[place])
                flips[place] |= found.descend
                stated[axis] += found.statements
                notes += found.notes
                hints += found.hints
            if step is not None:
                _add_step(one, step, stated[axis])
    nodes: list[h5py.Group | h5py.Dataset] = [dataset, dataset.parent, dataset.file["/"]]
    for node in nodes:
        _add_attributes(tree, node, axes, stated, is_own=node is dataset)
    z, y, x = (_choose(axis, stated[axis], notes) for axis in "zyx")
    notes, hints = list(dict.fromkeys(notes)), list(dict.fromkeys(hints))
    return SettledSpacing((z, y, x), tuple(flips), tuple(notes), ", ".join(hints))


def _choose(axis: str, stated: list[Statement], notes: list[str]) -> float | None:
    """Return the spacing along an axis, um; None: nothing states it."""
    if not stated:
        return None
    remedy = "--spacing-um z,y,x replaces it"
    settled = settle(Subject(f"voxel spacing along {axis}", "um", remedy=remedy), stated)
    notes += settled.notes
    return settled.number


class _Positions:
    """The statements of a dataset that holds the positions along an axis of `count` voxels.

    descend     whether they descend
    statements  the voxel spacing, um
    """

    def __init__(self, tree: Hdf5Tree, scale: h5py.Dataset, count: int) -> None:
        self.descend = False
        self.statements: list[Statement] = []
        self.notes: list[str] = []
        self.hints: list[str] = []
        self._name = str(scale.name)
        if (steps := _steps(tree, scale, count)) is None:
            return
        unit = tree.attribute(scale, "units")
        self._look_at(steps, unit if isinstance(unit, str) else "")

    def _look_at(self, steps: Steps, unit: str) -> None:
        name, size, shown = self._name, abs(steps.mean), f" {unit:.20}" if unit else ""
        self.descend = steps.mean < 0
        if self.descend:
            self.notes.append(
                f"positions of {name} descend: that axis is turned round, so that they rise"
            )
        if not steps.is_even:
            self.notes.append(
                f"positions of {name} are uneven: found steps of {steps.least:.5g} to "
                f"{steps.largest:.5g}{shown}: their mean, {size:.5g}, is used for all, so the "
                "shape is distorted; interpolate the volume at even positions for its true shape"
            )
        if (per := um_per(unit)) is not None:
            place = f"the list of positions {name}"
            self.statements.append(Statement(size * per, place, Trust.MEASURED))
        else:
            why = f"in {unit:.20}" if unit else "without a unit"
            self.hints.append(f"positions of {name} have steps of {size:.5g} {why}")


def _steps(tree: Hdf5Tree, scale: h5py.Dataset, count: int) -> Steps | None:
    """Return the steps of a dataset of positions; None: it holds none."""
    if scale.ndim != 1 or scale.dtype.kind not in "iuf" or not 1 < scale.size <= _MAX_POSITIONS:
        return None
    where = f"{tree.where}:{scale.name}"
    attributes = {name: tree.attribute(scale, name) for name in PACKING}
    values, _ = scaled(where, Hdf5Array(scale, where), attributes)
    return steps_of(np.asarray(values[(slice(None),)], np.float64), count)


def _add_step(one: Described, step: tuple[float, str], stated: list[Statement]) -> None:
    size, unit = step
    if (per := um_per(unit)) is not None:
        stated.append(Statement(size * per, f"the resolution of {one.names.place}"))


def _add_attributes(
    tree: Hdf5Tree,
    node: h5py.Group | h5py.Dataset,
    axes: Sequence[str],
    stated: dict[str, list[Statement]],
    *,
    is_own: bool,
) -> None:
    """Add the spacings that attributes of the dataset, or of a group around it, state."""
    found = {name: tree.attribute(node, name) for name in ATTRIBUTES}
    trust = Trust.STATED if is_own else Trust.REPEATED
    for name, spacing in stated_spacings(found, axes):
        for axis, value in zip("zyx", spacing, strict=True):
            stated[axis].append(Statement(value, f"{name} of {node.name}", trust))
