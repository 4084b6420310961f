"""Read BigDataViewer's XML beside an N5 or HDF5 container: setups, attributes, registrations.

References: https://imagej.net/plugins/bdv/index
"""

import re
from collections import Counter
from collections.abc import Collection, Mapping, Set
from itertools import islice
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from stereocell.read.bigdataviewer.described import Described, Matrix, Setup
from stereocell.read.repeats import record_xml
from stereocell.read.spacing import Triple, um_per
from stereocell.read.stated_numbers import numbers_of
from stereocell.storage.location import is_own

_MAX_FILES = 50  # XML files of a folder that are looked into at most
_MAX_BYTES = 16 << 20
_MAX_TIMES = 100_000
# Numbers of time points: `first`, `first-last` or `first-last:step`.
_RANGE = re.compile(r"(\d{1,9})(?:-(\d{1,9}))?(?::(\d{1,9}))?")


def read_described(path: str, xml: str = "") -> Described:
    """Return what the XML of a container on this machine states.

    xml  path of the XML that the user named; empty: the first one beside the container that names
         the container
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
        record_xml(root, file.name)
        loader = root.find("SequenceDescription/ImageLoader")
        named = [(node.text or "").strip() for node in loader] if loader is not None else []
        if xml or container.name in (Path(name).name for name in named if name):
            setups = {
                int(node.findtext("id", "").strip()): _setup(root, node)
                for node in root.findall("SequenceDescription/ViewSetups/ViewSetup")
                if node.findtext("id", "").strip().isdecimal()
            }
            missing = _missing(root)
            return Described(setups, _times(root, setups, missing), _registrations(root), missing)
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
        attributes,
    )


def _counts(text: str) -> Triple | None:
    parts = text.split()
    if len(parts) != 3 or not all(part.isdecimal() and len(part) < 10 for part in parts):
        return None
    x, y, z = (float(part) for part in parts)
    return x, y, z


def _registrations(root: ElementTree.Element) -> Mapping[tuple[int, int], Matrix]:
    """Return the registration of each view, by time point and setup; NaN: it can't be read."""
    found: dict[tuple[int, int], Matrix] = {}
    for node in root.findall("ViewRegistrations/ViewRegistration"):
        time, setup = node.get("timepoint", ""), node.get("setup", "")
        if not time.isdecimal() or not setup.isdecimal():
            continue
        matrix = np.eye(4)
        for text in node.findall("ViewTransform/affine"):
            matrix = matrix @ _affine(text.text or "")
        found[int(time), int(setup)] = matrix
    return found


def _affine(text: str) -> Matrix:
    """Return the matrix (4, 4) of an affine transform; NaN: the text isn't 12 finite numbers."""
    rows = np.array(numbers_of(text.split()))
    if rows.size != 12 or not np.isfinite(rows).all():
        return np.full((4, 4), np.nan)
    return np.vstack([rows.reshape(3, 4), [0.0, 0.0, 0.0, 1.0]])


def _missing(root: ElementTree.Element) -> frozenset[tuple[int, int]]:
    """Return the time point and setup of each view for which no image was taken."""
    views = root.findall("SequenceDescription/MissingViews/MissingView")
    pairs = [(view.get("timepoint", ""), view.get("setup", "")) for view in views]
    return frozenset(
        (int(time), int(setup)) for time, setup in pairs if time.isdecimal() and setup.isdecimal()
    )


def _times(
    root: ElementTree.Element, setups: Collection[int], missing: Set[tuple[int, int]]
) -> tuple[int, ...]:
    """Return the numbers of the time points, except those for which no image was taken."""
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
    absent = Counter(time for time, _ in missing)
    return tuple(sorted(n for n in numbers if absent[n] < len(setups)))


def container_of(path: str) -> str | None:
    """Return the path of the container as an XML states it; None: it states none."""
    file = Path(path)
    if file.stat().st_size > _MAX_BYTES:
        return None
    root = _parsed(file.read_text(encoding="utf-8", errors="replace"))
    loader = root.find("SequenceDescription/ImageLoader") if root is not None else None
    named = [(node.text or "").strip() for node in loader] if loader is not None else []
    return next((name for name in named if name), None)


def _parsed(text: str) -> ElementTree.Element | None:
    """Return the root of BigDataViewer's XML; None: another kind, damaged, or with entities."""
    if "<SpimData" not in text or "<!DOCTYPE" in text or "<!ENTITY" in text:
        return None
    try:
        return ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError, RecursionError):
        return None


def _size(text: str, unit: str) -> Triple | None:
    """Return z, y, x in um from a text `x y z` and its unit; None: they aren't lengths."""
    per = um_per(unit.strip())
    try:
        x, y, z = (float(part) for part in text.split())
    except ValueError:
        return None
    return None if per is None else (z * per, y * per, x * per)
