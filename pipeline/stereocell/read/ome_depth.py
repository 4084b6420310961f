"""The depth of voxels by the positions of the planes in OME-XML, compared with its other fields."""

from collections.abc import Sequence
from itertools import pairwise
from xml.etree import ElementTree

from stereocell.read import ome_xml
from stereocell.read.plane_positions import settle_places
from stereocell.read.spacing import um_per
from stereocell.read.statements import Statement


def settle_depth(
    root: ElementTree.Element, stated: Sequence[Statement]
) -> tuple[float | None, tuple[str, ...]]:
    """Return the depth of a voxel, um, and notes; None: no field states one.

    stated  the depth as other fields state it, in um, the most trusted first
    """
    places, has_unit = positions_of(root)
    depth, notes = settle_places(places, stated, "PositionZ", has_unit=has_unit)
    are_same = len(places) > 2 and len(set(places.values())) == 1
    return depth, (*notes, *(_SAME,) * (are_same and _times_rise(root)))


_SAME = (
    "the planes' PositionZ is the same and their DeltaT rises: they may be points in time (--axes "
    "with t in the place of z reads them so)"
)


def _planes(root: ElementTree.Element) -> list[ElementTree.Element]:
    """Return the planes of the first channel and time that are described."""
    planes = ome_xml.planes_of(root)
    first = min(((p.get("TheT", "0"), p.get("TheC", "0")) for p in planes), default=("", ""))
    return [p for p in planes if (p.get("TheT", "0"), p.get("TheC", "0")) == first]


def positions_of(root: ElementTree.Element) -> tuple[dict[int, float], bool]:
    """Return PositionZ in um by TheZ, and whether a unit of length is stated.

    Without any unit um are assumed. The unit `reference frame` is no length.
    """
    found: dict[int, float] = {}
    planes = _planes(root)
    has_unit = any("PositionZUnit" in plane.attrib for plane in planes)
    for plane in planes:
        unit = plane.get("PositionZUnit") if has_unit else "um"
        per, place = um_per(unit), plane.get("TheZ", "")
        try:
            value = float(plane.get("PositionZ", ""))
        except ValueError:
            continue
        if per is not None and place.isdecimal() and abs(value) < 1e12:
            found[int(place)] = value * per
    return found, has_unit


def _times_rise(root: ElementTree.Element) -> bool:
    try:
        times = [float(plane.get("DeltaT", "")) for plane in _planes(root)]
    except ValueError:
        return False
    return all(a < b for a, b in pairwise(times))
