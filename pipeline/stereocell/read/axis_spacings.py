"""Collect the voxel spacing and the directions of an array's axes from everything that states them.

Positions along an axis take precedence over attributes, since they are written plane by plane. An
axis whose positions descend is reversed: read as stored, the volume would be a mirror image. The
readers of HDF5, Zarr and N5 add the statements of their files; `settled` compares them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.read.array_spacing import stated_spacings
from stereocell.read.coordinates import Steps, steps_of
from stereocell.read.spacing import PartialTriple, um_per
from stereocell.read.statements import Statement, Subject, Trust, settle

MAX_POSITIONS = 1_000_000  # positions; longer lists are not read


@dataclass(frozen=True, slots=True)
class SettledSpacing:
    """The spacing (z, y, x), um, with None where it is not stated, and which axes are reversed.

    hint  steps between positions that have no unit of length, for the message on missing spacing
    """

    spacing_um: PartialTriple
    flips: tuple[bool, ...]
    notes: tuple[str, ...]
    hint: str = ""


class AxisSpacings:
    """Statements on the voxel spacing of one array.

    axes  names of the array's axes, slowest first
    """

    def __init__(self, axes: Sequence[str]) -> None:
        self.axes = tuple(axes)
        self._stated: dict[str, list[Statement]] = {axis: [] for axis in "zyx"}
        self._flips = [False] * len(self.axes)
        self._notes: list[str] = []
        self._hints: list[str] = []

    def add(self, axis: str, spacing_um: float, place: str, trust: Trust = Trust.STATED) -> None:
        """Add the spacing along an axis; axes other than z, y and x are ignored."""
        if axis in self._stated:
            self._stated[axis].append(Statement(float(spacing_um), place, trust))

    def add_all(self, spacing_um: Sequence[float], place: str, trust: Trust = Trust.STATED) -> None:
        """Add the spacing (z, y, x), um."""
        for axis, value in zip("zyx", spacing_um, strict=True):
            self.add(axis, value, place, trust)

    def add_attributes(
        self, attributes: Mapping[str, Any], of: str, trust: Trust = Trust.STATED
    ) -> None:
        """Add the spacings in the attributes of the array, or of a group around it, as statements.

        of  name of the array or the group, for notes
        """
        for name, spacing in stated_spacings(attributes, self.axes):
            self.add_all(spacing, f"{name} of {of}", trust)
            z, y, x = spacing
            if z == y != x:
                self._notes.append(
                    f"voxel spacing: {name} of {of} gives z and y the same spacing and x another "
                    "one, so its order may differ from that of the axes: --spacing-um z,y,x "
                    "replaces it"
                )

    def add_positions(
        self, dimension: int, name: str, positions: NDArray[np.float64], unit: str, count: int
    ) -> None:
        """Add the positions of the `count` voxels along a dimension of the array.

        name  of the list of positions, for notes
        """
        if self.axes[dimension] not in self._stated:
            return
        steps = steps_of(positions, count)
        if steps is None:
            self._add_odd(name, positions, count)
            return
        self._flips[dimension] |= steps.mean < 0
        self._notes += _notes_on(steps, name, f" {unit:.20}" if unit else "")
        size = abs(steps.mean)
        if (per := um_per(unit)) is not None:
            place = f"the list of positions {name}"
            self.add(self.axes[dimension], size * per, place, Trust.MEASURED)
        else:
            why = f"in {unit:.20}" if unit else "without a unit"
            self._hints.append(f"positions of {name} have steps of {size:.5g} {why}")

    def add_sense(self, dimension: int, name: str, positive: str) -> None:
        """Add CF's attribute `positive` (up or down) of the positions along a dimension."""
        if self.axes[dimension] == "z" and positive.strip().lower() == "down":
            self._notes.append(
                f"positions of {name} count downwards (`positive`): the planes are read in this "
                "order, so the volume is a mirror image where y points north"
            )

    def _add_odd(self, name: str, positions: NDArray[np.float64], count: int) -> None:
        """Add a note on positions that match the number of voxels but don't rise or fall steadily.

        Equal positions get no note: a netCDF dimension without a variable has them.
        """
        found = np.ravel(positions)
        if count > 1 and len(found) in (count, count + 1) and (found != found[0]).any():
            rest = "hold no number at some voxels"
            if np.isfinite(found).all():
                rest = "neither rise nor fall throughout"
            self._notes.append(
                f"positions of {name} {rest}, so they are not used. Planes are read in the file's "
                "order, which may not be the specimen's. If it is not, sort them in the file"
            )

    def settled(self) -> SettledSpacing:
        """Return the most trusted spacing along each axis, with notes on contradictions."""
        z, y, x = (self._choose(axis) for axis in "zyx")
        notes, hints = dict.fromkeys(self._notes), dict.fromkeys(self._hints)
        return SettledSpacing((z, y, x), tuple(self._flips), tuple(notes), ", ".join(hints))

    def _choose(self, axis: str) -> float | None:
        if not self._stated[axis]:
            return None
        subject = Subject(
            f"voxel spacing along {axis}", "um", remedy="--spacing-um z,y,x replaces it"
        )
        settled = settle(subject, self._stated[axis])
        self._notes += settled.notes
        return settled.number


def _notes_on(steps: Steps, name: str, shown: str) -> list[str]:
    """Return sentences on positions that descend or are uneven.

    shown  the unit with a space before it; empty: none
    """
    notes = []
    if steps.mean < 0:
        notes.append(f"positions of {name} descend: that axis is reversed, so that they rise")
    if not steps.is_even:
        notes.append(
            f"positions of {name} are uneven: found steps of {steps.least:.5g} to "
            f"{steps.largest:.5g}{shown}: their mean, {abs(steps.mean):.5g}, is used throughout, "
            "which distorts the shape; interpolate the volume at even positions to avoid this"
        )
    return notes
