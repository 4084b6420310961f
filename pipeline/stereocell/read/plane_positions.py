"""Compare the stated depth of voxels with the positions of the planes, and find sideways drift."""

from collections.abc import Mapping, Sequence
from itertools import pairwise

from stereocell.read.statements import Statement, Subject, Trust, settle

_EVEN = 0.1  # share of the mean step by which one may differ: rounding, precision of a drive
_TOLERANCE = 0.01  # relative difference up to which two depths agree
_MOST_APART = 50.0  # ratio of two depths; a larger one is due to a wrong unit
_MOST_ASIDE = 0.5  # voxels by which planes may lie beside each other without a note
_SUBJECT = Subject(
    "voxel spacing along z", "um", _TOLERANCE, remedy="--spacing-um z,y,x replaces it"
)


def falling_notes(field: str, first_um: float, last_um: float) -> tuple[str, ...]:
    """Return a note if planes were taken downwards, since the volume may be a mirror image."""
    if last_um >= first_um:
        return ()
    return (
        f"the planes' {field} falls from {first_um:.5g} to {last_um:.5g} um: the planes are read "
        "in the order of the file",
    )


def drift_notes(
    places: Mapping[int, float], field: str, axis: str, pixel_um: float | None
) -> tuple[str, ...]:
    """Return a note if planes were taken at different positions within their plane.

    places    position along x or y of each plane, um, by the plane's number
    axis      x or y
    pixel_um  voxel spacing along this axis; None: not stated
    """
    apart = max(places.values(), default=0.0) - min(places.values(), default=0.0)
    if apart <= _MOST_ASIDE * (pixel_um or 0.0):
        return ()
    share = f" ({apart / pixel_um:.3g} voxels)" if pixel_um else ""
    return (
        f"the planes' {field} differs by up to {apart:.4g} um{share}: the planes are not shifted "
        f"along {axis}, so the specimen is sheared or jumps if the stage moved",
    )


def settle_places(
    places: Mapping[int, float], stated: Sequence[Statement], field: str, *, has_unit: bool
) -> tuple[float | None, tuple[str, ...]]:
    """Return the depth of a voxel, um, and notes; None: no field states a depth.

    places    position along z of each plane, um, by the plane's number
    stated    the depth in other fields, um, the most trusted first
    field     name of the field that states the positions
    has_unit  whether the positions have a stated unit of length; otherwise um are assumed
    """
    settled = settle(_SUBJECT, stated) if stated else None
    stated_um, own = (None, ()) if settled is None else (settled.number, settled.notes)
    numbers = sorted(places)
    if len(numbers) < 2 or max(places.values()) == min(places.values()):
        return stated_um, own
    if stated_um is not None and stated_um <= 0:
        stated_um = None
    steps = [(places[b] - places[a]) / (b - a) for a, b in pairwise(numbers)]
    if min(steps) <= 0 <= max(steps):
        note = f"the planes' {field} rises and falls: not compared with the voxel spacing"
        return stated_um, (*own, note)
    if not has_unit and stated_um is None:
        return None, ()
    first, last = places[numbers[0]], places[numbers[-1]]
    step, sizes = abs(last - first) / (numbers[-1] - numbers[0]), [abs(one) for one in steps]
    is_even = max(sizes) - step <= _EVEN * step and step - min(sizes) <= _EVEN * step
    notes = list(falling_notes(field, first, last))
    if not is_even:
        notes.append(
            f"the planes' {field} is uneven: steps of {min(sizes):.4g} to {max(sizes):.4g} um"
        )
    if stated_um is None:
        return step, (*notes, f"voxel spacing along z: {step:.5g} um by the planes' {field}")
    is_near = 1 / _MOST_APART < step / stated_um < _MOST_APART
    trust = Trust.MEASURED if is_even and is_near and has_unit else Trust.REPEATED
    place = f"{field} of the planes" + " (um are assumed)" * (not has_unit)
    settled = settle(_SUBJECT, [*stated, Statement(step, place, trust)])
    is_other = settled.chosen.place == place and settled.notes
    return (step if is_other else stated_um), (*notes, *settled.notes)
