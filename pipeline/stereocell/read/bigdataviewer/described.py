"""The setups of a BigDataViewer container as its XML states them, and the views that they form.

Each view is an image of its own with one tile, angle and illumination; its setups are its channels.

References: https://imagej.net/plugins/bdv/index
"""

import math
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, field
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.read.series import Candidate, candidate
from stereocell.read.spacing import Triple

_OF_A_VIEW = ("tile", "angle", "illumination")  # attributes whose values separate images
_OF_A_CHANNEL = ("channel", "displaysettings")  # attributes that may differ within one image
_CHANNEL = "channel"
_OTHER_SCALE = 0.05  # relative difference in scale; chromatic aberration stays below 0.01
# cosine of the largest angle between the same axis of two channels
_OTHER_DIRECTION = math.cos(math.radians(45))
_SHOWN = 8  # missing time points or setups that a message lists at most

Matrix = NDArray[np.float64]  # (4, 4), for column vectors: from voxels (x, y, z, 1) to the world


def have_one_grid(first: Matrix, other: Matrix) -> bool:
    """Return whether two registrations agree in scale and direction; their shifts may differ."""
    if not (np.isfinite(first).all() and np.isfinite(other).all()):
        return True  # unreadable registrations count as equal; the reader reports them
    relative = np.linalg.pinv(first[:3, :3]) @ other[:3, :3]
    lengths = np.linalg.norm(relative, axis=0)
    return bool(
        np.abs(lengths - 1.0).max() <= _OTHER_SCALE
        and (np.diag(relative) > _OTHER_DIRECTION * lengths).all()
    )


@dataclass(frozen=True, slots=True)
class Setup:
    """One channel of a view.

    spacing_um  (z, y, x); None: not stated in a unit of length
    unit_um     length of the voxel size's unit in um; None: it is not a unit of length
    size        voxels (x, y, z); None: not stated
    attributes  numbers by attribute name: tile, channel and others, also the user's own
    """

    name: str | None
    spacing_um: Triple | None
    unit_um: float | None = None
    size: Triple | None = None
    attributes: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Described:
    """The setups of an XML by their numbers, and its time points; both are empty without an XML.

    registrations  readable ones, by time point and setup
    missing        pairs of time point and setup for which no image was taken
    """

    setups: Mapping[int, Setup]
    times: tuple[int, ...] = ()
    registrations: Mapping[tuple[int, int], Matrix] = field(default_factory=dict)
    missing: Set[tuple[int, int]] = frozenset()

    def views(self, setups: Sequence[int]) -> list[list[int]]:
        """Group setups into views, by tile, angle, illumination and the user's own attributes.

        The setups of a view are its channels, so two setups of one channel are two views. An own
        attribute separates views if setups of one channel differ in it; otherwise it describes the
        channel. Setups registered at another scale or in another direction form another view.
        """
        found: dict[tuple[object, ...], list[int]] = {}
        repeated = self._repeated(setups)
        names = self._view_names(setups)
        for number in setups:
            key = self._values(number, names)
            found.setdefault((*key, number) if number in repeated else key, []).append(number)
        return [view for group in found.values() for view in self._by_registration(group)]

    def _by_registration(self, setups: Sequence[int]) -> list[list[int]]:
        """Group setups by the scale and direction of their registrations at their first time."""
        placed: dict[int, Matrix] = {}
        for time, setup in sorted(self.registrations):
            if (time, setup) not in self.missing:
                placed.setdefault(setup, self.registrations[time, setup])
        views: list[list[int]] = []
        for setup in setups:
            own = placed.get(setup)
            for view in views:
                first = placed.get(view[0])
                if own is None or first is None or have_one_grid(first, own):
                    view.append(setup)
                    break
            else:
                views.append([setup])
        return views

    def _repeated(self, setups: Sequence[int]) -> set[int]:
        """Return the setups whose attributes and channel repeat those of an earlier setup."""
        found: dict[tuple[object, ...], int] = {}
        names = [*self._view_names(setups), _CHANNEL]
        stated = [number for number in setups if _CHANNEL in self._attributes(number)]
        first = [found.setdefault(self._values(number, names), number) for number in stated]
        return {number for number, other in zip(stated, first, strict=True) if number != other}

    def _attributes(self, number: int) -> Mapping[str, str]:
        own = self.setups.get(number)
        return own.attributes if own is not None else {}

    def _values(self, number: int, names: Sequence[str]) -> tuple[object, ...]:
        own = self._attributes(number)
        return tuple(own.get(name) for name in names)

    def _view_names(self, setups: Sequence[int]) -> list[str]:
        """Return the names of the attributes whose values separate views."""
        every = dict.fromkeys(name for number in setups for name in self._attributes(number))
        own = [name for name in every if name not in (*_OF_A_VIEW, *_OF_A_CHANNEL)]
        names = [name for name in _OF_A_VIEW if name in every]
        for name in own:
            values: dict[tuple[object, ...], set[object]] = {}
            for number in setups:
                key = self._values(number, [*names, _CHANNEL])
                values.setdefault(key, set()).add(self._attributes(number).get(name))
            if any(len(one) > 1 for one in values.values()):
                names.append(name)
        return names

    def candidate(self, view: Sequence[int]) -> Candidate:
        """Return the entry of a view in the list of series."""
        own = self.setups.get(view[0]) or Setup(None, None)
        x, y, z = (int(size) for size in own.size or (1, 1, 1))
        found = candidate(
            (z, y, x),
            channels=len(view),
            times=max(len(self.times), 1),
            spacing_um=own.spacing_um,
        )
        every = sorted(self.setups)
        names = [name for name in self._view_names(every) if name in own.attributes]
        shown = [f"{name:.20} {own.attributes[name]:.20}" for name in names]
        alike = [
            other
            for other in self.views(every)
            if self._values(other[0], names) == self._values(view[0], names)
        ]
        if len(alike) > 1:
            shown += [f"setup {number}" for number in view]
            is_repeated = any(self._repeated(every).intersection(other) for other in alike)
            shown += [] if is_repeated else ["registered apart from others"]
        label = ", ".join([*shown, found.label])
        return Candidate(label, found.voxels)

    def alone(self, setup: int) -> "Described":
        """Return the part of the XML that describes one setup."""
        own = {setup: self.setups[setup]} if setup in self.setups else {}
        placed = {key: one for key, one in self.registrations.items() if key[1] == setup}
        missing = frozenset(key for key in self.missing if key[1] == setup)
        return Described(own, self.times, placed, missing)

    def among(self, setups: Sequence[int]) -> dict[int, Setup | None]:
        """Return some setups by their numbers; None: the XML has no such setup."""
        return {number: self.setups.get(number) for number in setups}

    def taken(
        self, where: str, setups: Sequence[int], times: Sequence[int]
    ) -> set[tuple[int, int]]:
        """Return the pairs of time point and setup that are not listed as missing.

        Raises SourceError where all are listed as missing.
        """
        found = {(t, s) for t in times for s in setups if (t, s) not in self.missing}
        if not found:
            raise SourceError(
                f"{where}: found no view of this image, since MissingViews of the XML lists all of "
                "them, expected another --series"
            )
        return found

    def require_views(self, where: str, setups: Sequence[int], times: Sequence[int]) -> None:
        """Raise SourceError where a container lacks setups or time points.

        The XML lists those expected; without one, all from the first to the last are expected.
        """
        parts = (("setups", setups, tuple(self.setups)), ("time points", times, self.times))
        for noun, found, listed in parts:
            present, first, last = set(found), min(found), max(found)
            # Numbers go up to 10^12, so the numbers in between are never listed.
            expected = sorted(set(listed)) if listed else range(first, last + 1)
            size = len(expected) if listed else last - first + 1
            count = len(present.intersection(expected)) if listed else len(present)
            if count < size:
                missing = (number for number in expected if number not in present)
                shown = ", ".join(map(str, islice(missing, _SHOWN)))
                more = ", ..." * (size - count > _SHOWN)
                source = "in the XML" if listed else f"up to {max(found)}"
                raise SourceError(
                    f"{where}: found {count} of {size} {noun} {source}, missing "
                    f"{shown}{more}, expected all of them: copy the container again"
                )
