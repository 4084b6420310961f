"""BigDataViewer's XML beside a container of N5 or HDF5: the setups' names and voxel sizes.

References: https://imagej.net/plugins/bdv/index
"""

from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from xml.etree import ElementTree

from stereocell.read.spacing import Triple, um_per
from stereocell.storage.location import is_own

_MAX_FILES = 50  # most XML files of the folder that are looked into
_MAX_BYTES = 16 << 20


@dataclass(frozen=True, slots=True)
class Setup:
    """One channel, angle or tile. spacing_um  (z, y, x); None: not stated in a unit of length."""

    name: str | None
    spacing_um: Triple | None


def read_setups(path: str) -> dict[int, Setup]:
    """Return the setups of the XML that names a container on this machine; empty: there is none."""
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
            return {
                int(node.findtext("id", "").strip()): Setup(
                    node.findtext("name", "").strip() or None,
                    _size(node.findtext("voxelSize/size", ""), node.findtext("voxelSize/unit", "")),
                )
                for node in root.findall("SequenceDescription/ViewSetups/ViewSetup")
                if node.findtext("id", "").strip().isdecimal()
            }
    return {}


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
