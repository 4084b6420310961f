"""BigDataViewer's XML beside a container of N5 or HDF5: setups, their attributes, registrations.

References: https://imagej.net/plugins/bdv/index
"""

import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.read.series import Candidate, candidate
from stereocell.read.spacing import Triple, um_per
from stereocell.storage.location import is_own

_MAX_FILES = 50  # most XML files of the folder that are looked into
_MAX_BYTES = 16 << 20
_MAX_TIMES = 100_000
_OF_A_VIEW = ("tile", "angle", "illumination")  # attributes of which no two make one image
_SHOWN = 8  # numbers in a message
_RANGE = re.compile(r"(\d{1,9})(?:-(\d{1,9}))?(?::(\d{1,9}))?")  # first-last:step


Matrix = NDArray[np.float64]  # (4, 4) for columns, from voxels (x, y, z, 1) to the world


@dataclass(frozen=True, slots=True)
class Setup:
    """One channel of a view.

    spacing_um  (z, y, x); None: not stated in a unit of length
    unit_um     the unit of the voxel size in um; None: no unit of length
    size        voxels (x, y, z); None: not stated
    view        the tile, angle and illumination as pairs of name and number
    """

    name: str | None
    spacing_um: Triple | None
    unit_um: float | None = None
    size: Triple | None = None
    view: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class Described:
    """The setups of an XML by their numbers, and its time points; both empty without an XML.

    registrations  by time point and setup, where they can be read
    """

    setups: Mapping[int, Setup]
    times: tuple[int, ...] = ()
    registrations: Mapping[tuple[int, int], Matrix] = field(default_factory=dict)

    def views(self, setups: Sequence[int]) -> list[list[int]]:
        """Return setups by tile, angle and illumination; those of a view are its channels."""
        found: dict[tuple[tuple[str, str], ...], list[int]] = {}
        for number in setups:
            own = self.setups.get(number)
            found.setdefault(own.view if own else (), []).append(number)
        return list(found.values())

    def candidate(self, view: Sequence[int]) -> Candidate:
        """Return what a list says of a view."""
        own = self.setups.get(view[0]) or Setup(None, None)
        x, y, z = (int(size) for size in own.size or (1, 1, 1))
        found = candidate(
            (z, y, x),
            channels=len(view),
            times=max(len(self.times), 1),
            spacing_um=own.spacing_um,
        )
        label = ", ".join([f"{name} {number}" for name, number in own.view] + [found.label])
        return Candidate(label, found.voxels)

    def among(self, setups: Sequence[int]) -> dict[int, Setup]:
        """Return the setups by their place among those of a container."""
        return {
            place: self.setups[number]
            for place, number in enumerate(setups)
            if number in self.setups
        }

    def require_views(self, where: str, setups: Sequence[int], times: Sequence[int]) -> None:
        """Raise SourceError where a container lacks setups or time points.

        They are those of the XML, or without one all from the first to the last.
        """
        parts = (("setups", setups, tuple(self.setups)), ("time points", times, self.times))
        for noun, found, listed in parts:
            present, first, last = set(found), min(found), max(found)
            # groups may be numbered up to 10^12, so that all numbers in between make no list
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


def read_described(path: str, xml: str = "") -> Described:
    """Return what the XML of a container on this machine states.

    xml  the XML that the user named; empty: the first one beside the container that names it
    """
    container = Path(path)
    beside = sorted(container.parent.glob("*.xml"))
    for file in islice([Path(xml)] if xml else beside, _MAX_FILES):
        own = bool(xml) or is_own(file, [container.parent.resolve()])
        if not own or not file.is_file() or file.stat().st_size > _MAX_BYTES:
            continue
        root = _parsed(file.read_text(encoding="utf-8", errors="replace"))
        if root is None:
            continue
        loader = root.find("SequenceDescription/ImageLoader")
        named = [(node.text or "").strip() for node in loader] if loader is not None else []
        if xml or container.name in (Path(name).name for name in named if name):
            setups = {
                int(node.findtext("id", "").strip()): _setup(root, node)
                for node in root.findall("SequenceDescription/ViewSetups/ViewSetup")
                if node.findtext("id", "").strip().isdecimal()
            }
            return Described(setups, _times(root, setups), _registrations(root))
    return Described({})


def _setup(root: ElementTree.Element, node: ElementTree.Element) -> Setup:
    unit = node.findtext("voxelSize/unit", "").strip()
    attributes = {one.tag: (one.text or "").strip() for one in node.findall("attributes/*")}
    channel = root.find(
        "SequenceDescription/ViewSetups/Attributes[@name='channel']/"
        f"Channel[id='{attributes.get('channel', '')}']/name"
    ) if attributes.get("channel", "").isdecimal() else None  # fmt: skip
    named = (channel.text or "").strip() if channel is not None else ""
    name = node.findtext("name", "").strip() or ("" if named.isdecimal() else named)
    return Setup(
        name or None,
        _size(node.findtext("voxelSize/size", ""), unit),
        um_per(unit),
        _counts(node.findtext("size", "")),
        tuple((key, attributes[key]) for key in _OF_A_VIEW if key in attributes),
    )


def _counts(text: str) -> Triple | None:
    parts = text.split()
    if len(parts) != 3 or not all(part.isdecimal() and len(part) < 10 for part in parts):
        return None
    x, y, z = (float(part) for part in parts)
    return x, y, z


def _registrations(root: ElementTree.Element) -> Mapping[tuple[int, int], Matrix]:
    """Return the registration of each view, by time point and setup; others are left out."""
    found: dict[tuple[int, int], Matrix] = {}
    for node in root.findall("ViewRegistrations/ViewRegistration"):
        time, setup = node.get("timepoint", ""), node.get("setup", "")
        if not time.isdecimal() or not setup.isdecimal():
            continue
        matrix = np.eye(4)
        for text in node.findall("ViewTransform/affine"):
            try:
                rows = np.array([float(part) for part in (text.text or "").split()])
                matrix = matrix @ np.vstack([rows.reshape(3, 4), [0.0, 0.0, 0.0, 1.0]])
            except ValueError:
                break
        else:
            found[int(time), int(setup)] = matrix
    return found


def _times(root: ElementTree.Element, setups: Collection[int]) -> tuple[int, ...]:
    """Return the numbers of the time points, except those at which no view was taken."""
    node = root.find("SequenceDescription/Timepoints")
    if node is None:
        return ()
    first, last = (node.findtext(name, "").strip() for name in ("first", "last"))
    pattern = node.findtext("integerpattern", "").replace(" ", "")
    numbers: set[int] = set()
    if first.isdecimal() and last.isdecimal():
        pattern = f"{first}-{last}"
    for part in pattern.split(",") if pattern else ():
        found = _RANGE.fullmatch(part)
        if found is None:
            return ()
        low, high, step = int(found[1]), int(found[2] or found[1]), int(found[3] or 1)
        numbers.update(islice(range(low, high + 1, max(step, 1)), _MAX_TIMES))
    absent = Counter(
        view.get("timepoint", "")
        for view in root.findall("SequenceDescription/MissingViews/MissingView")
    )
    return tuple(sorted(n for n in numbers if absent[str(n)] < len(setups)))


def container_of(path: str) -> str | None:
    """Return the path of the container that an XML names, as it stands there; None: none."""
    file = Path(path)
    if file.stat().st_size > _MAX_BYTES:
        return None
    root = _parsed(file.read_text(encoding="utf-8", errors="replace"))
    loader = root.find("SequenceDescription/ImageLoader") if root is not None else None
    named = [(node.text or "").strip() for node in loader] if loader is not None else []
    return next((name for name in named if name), None)


def _parsed(text: str) -> ElementTree.Element | None:
    """Return the root of the XML; None: it is another's, or damaged, or has entities."""
    if "<SpimData" not in text or "<!DOCTYPE" in text or "<!ENTITY" in text:
        return None
    try:
        return ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError, RecursionError):
        return None


def _size(text: str, unit: str) -> Triple | None:
    """Return z, y, x in um of a text `x y z` and its unit; None: no lengths."""
    per = um_per(unit.strip())
    try:
        x, y, z = (float(part) for part in text.split())
    except ValueError:
        return None
    return None if per is None else (z * per, y * per, x * per)
