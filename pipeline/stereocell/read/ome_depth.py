"""Read the positions of the planes from OME-XML: the depth of voxels, and sideways drift."""

from collections.abc import Sequence
from itertools import pairwise
from xml.etree import ElementTree

from stereocell.read import ome_xml
from stereocell.read.plane_positions import drift_notes, settle_places
from stereocell.read.spacing import um_per
from stereocell.read.stated_numbers import numbers_of
from stereocell.read.statements import Statement


def settle_depth(
    root: ElementTree.Element, stated: Sequence[Statement]
) -> tuple[float | None, tuple[str, ...]]:
    """Return the depth of a voxel, um, and notes; None: no field states a depth.

    stated  the depth in other fields, um, the most trusted first
    """
    places, has_unit = positions_of(root)
    depth, notes = settle_places(places, stated, "PositionZ", has_unit=has_unit)
    are_same = len(places) > 2 and len(set(places.values())) == 1
    notes = (*notes, *(_SAME,) * (are_same and _times_rise(root)))
    return depth, (*notes, *(note for axis in "XY" for note in _drift_notes(root, axis)))


def _drift_notes(root: ElementTree.Element, axis: str) -> tuple[str, ...]:
    """Return a note if the planes lie at different positions along x or y."""
    pixels = ome_xml.pixels_of(root)
    places, _ = positions_of(root, axis)
    if pixels is None or len(places) < 2:
        return ()
    per = um_per(pixels.get(f"PhysicalSize{axis}Unit", "um"))
    sizes = numbers_of([pixels.get(f"PhysicalSize{axis}")])
    pixel_um = sizes[0] * per if sizes and per is not None else None
    return drift_notes(places, f"Position{axis}", axis.lower(), pixel_um)


_SAME = (
    "the planes' PositionZ is the same and their DeltaT rises: they may be time points (--axes "
    "with t in place of z reads them so)"
)


def _planes(root: ElementTree.Element) -> list[ElementTree.Element]:
    """Return the described planes of the first channel and time point."""
    planes = ome_xml.planes_of(root)
    first = min(((p.get("TheT", "0"), p.get("TheC", "0")) for p in planes), default=("", ""))
    return [p for p in planes if (p.get("TheT", "0"), p.get("TheC", "0")) == first]


def positions_of(root: ElementTree.Element, axis: str = "Z") -> tuple[dict[int, float], bool]:
    """Return PositionZ (or X or Y) in um by TheZ, and whether a unit of length is stated.

    um are assumed where no plane states a unit. The unit `reference frame` is not a length.
    """
    found: dict[int, float] = {}
    planes, field = _planes(root), f"Position{axis}"
    has_unit = any(f"{field}Unit" in plane.attrib for plane in planes)
    for plane in planes:
        unit = plane.get(f"{field}Unit") if has_unit else "um"
        per, place = um_per(unit), plane.get("TheZ", "")
        try:
            value = float(plane.get(field, ""))
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
