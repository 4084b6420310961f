"""BigDataViewer's XML beside a container of N5 or HDF5: the setups' names and voxel sizes.

References: https://imagej.net/plugins/bdv/index
"""

import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from xml.etree import ElementTree

from stereocell.model.errors import SourceError
from stereocell.read.spacing import Triple, um_per
from stereocell.storage.location import is_own

_MAX_FILES = 50  # most XML files of the folder that are looked into
_MAX_BYTES = 16 << 20
_MAX_TIMES = 100_000
_SHOWN = 8  # numbers in a message
_RANGE = re.compile(r"(\d{1,9})(?:-(\d{1,9}))?(?::(\d{1,9}))?")  # first-last:step


@dataclass(frozen=True, slots=True)
class Setup:
    """One channel, angle or tile. spacing_um  (z, y, x); None: not stated in a unit of length."""

    name: str | None
    spacing_um: Triple | None


@dataclass(frozen=True, slots=True)
class Described:
    """The setups of an XML by their numbers, and its time points; both empty without an XML."""

    setups: Mapping[int, Setup]
    times: tuple[int, ...] = ()

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


def read_described(path: str) -> Described:
    """Return the setups and time points in the XML of a container on this machine."""
    container = Path(path)
    for file in islice(sorted(container.parent.glob("*.xml")), _MAX_FILES):
        own = is_own(file, [container.parent.resolve()]) and file.is_file()
        if not own or file.stat().st_size > _MAX_BYTES:
            continue
        root = _parsed(file.read_text(encoding="utf-8", errors="replace"))
        if root is None:
            continue
        loader = root.find("SequenceDescription/ImageLoader")
        named = [(node.text or "").strip() for node in loader] if loader is not None else []
        if container.name in (Path(name).name for name in named if name):
            setups = {
                int(node.findtext("id", "").strip()): Setup(
                    node.findtext("name", "").strip() or None,
                    _size(node.findtext("voxelSize/size", ""), node.findtext("voxelSize/unit", "")),
                )
                for node in root.findall("SequenceDescription/ViewSetups/ViewSetup")
                if node.findtext("id", "").strip().isdecimal()
            }
            return Described(setups, _times(root, setups))
    return Described({})


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
