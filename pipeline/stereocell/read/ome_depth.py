"""The depth of voxels by the positions of the planes in OME-XML, compared with its other fields."""

from collections.abc import Sequence
from itertools import pairwise
from xml.etree import ElementTree

from stereocell.read import ome_xml
from stereocell.read.spacing import um_per
from stereocell.read.statements import Statement, Subject, Trust, settle

_EVEN = 0.1  # largest difference of a step from the mean, as its share: rounding, and a drive's
_TOLERANCE = 0.01  # relative difference of two depths that needs no note
_MOST_APART = 50.0  # a larger ratio of two depths is one of units
_SUBJECT = Subject(
    "voxel spacing along z", "um", _TOLERANCE, remedy="--spacing-um z,y,x replaces it"
)


def settle_depth(
    root: ElementTree.Element, stated: Sequence[Statement]
) -> tuple[float | None, tuple[str, ...]]:
    """Return the depth of a voxel, um, and notes; None: no field states one.

    stated  the depth as other fields state it, in um, the most trusted first
    """
    stated = [one for one in stated if isinstance(one.value, float | int) and one.value > 0]
    settled = settle(_SUBJECT, stated) if stated else None
    stated_um = None if settled is None else settled.number
    own_notes = () if settled is None else settled.notes
    places, has_unit = _positions(root)
    numbers = sorted(places)
    if len(numbers) < 2:
        return stated_um, own_notes
    steps = [(places[b] - places[a]) / (b - a) for a, b in pairwise(numbers)]
    first, last = places[numbers[0]], places[numbers[-1]]
    mean = (last - first) / (numbers[-1] - numbers[0])
    if max(places.values()) == min(places.values()):
        return stated_um, (*own_notes, *(_SAME,) * (len(numbers) > 2 and _times_rise(root)))
    if min(steps) <= 0 <= max(steps):
        note = "the planes' PositionZ rises and falls: not compared with the voxel spacing"
        return stated_um, (*own_notes, note)
    notes = []
    if mean < 0:
        notes.append(
            f"the planes' PositionZ falls from {first:.5g} to {last:.5g} um: the planes are read "
            "in the order of the file"
        )
    step, sizes = abs(mean), [abs(one) for one in steps]
    is_even = max(sizes) - step <= _EVEN * step and step - min(sizes) <= _EVEN * step
    if not is_even:
        notes.append(
            f"the planes' PositionZ is uneven: steps of {min(sizes):.4g} to {max(sizes):.4g} um"
        )
    if not has_unit and stated_um is None:
        return stated_um, ()
    if stated_um is None:
        notes.append(f"voxel spacing along z: {step:.5g} um by the planes' PositionZ")
        return step, tuple(notes)
    is_near = 1 / _MOST_APART < step / stated_um < _MOST_APART
    trust = Trust.MEASURED if is_even and is_near and has_unit else Trust.REPEATED
    place = "PositionZ of the planes" + " (um are assumed)" * (not has_unit)
    settled = settle(_SUBJECT, [*stated, Statement(step, place, trust)])
    is_other = settled.chosen.place == place and settled.notes
    return (step if is_other else stated_um), (*notes, *settled.notes)


_SAME = (
    "the planes' PositionZ is the same and their DeltaT rises: they may be points in time (--axes "
    "with t in the place of z reads them so)"
)


def _planes(root: ElementTree.Element) -> list[ElementTree.Element]:
    """Return the planes of the first channel and time that are described."""
    planes = ome_xml.planes_of(root)
    first = min(((p.get("TheT", "0"), p.get("TheC", "0")) for p in planes), default=("", ""))
    return [p for p in planes if (p.get("TheT", "0"), p.get("TheC", "0")) == first]


def _positions(root: ElementTree.Element) -> tuple[dict[int, float], bool]:
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
