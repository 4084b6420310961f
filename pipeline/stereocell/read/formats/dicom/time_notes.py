"""Notes for the user on several images at one place: time points, directions, duplicates."""

from stereocell.model.counted import agreeing, counted
from stereocell.read.formats.dicom.frame import Frame
from stereocell.read.formats.dicom.time_points import (
    BY_IMAGE_INDEX,
    BY_NUMBER,
    BY_POSITION,
    BY_REPETITION,
    Points,
)
from stereocell.read.statements import omission

_MOST_COUNTS = 4  # time points that a note lists one by one
_MOST_SHOWN = 9999  # larger values of an attribute are not shown, because they may be dates
_UNITS = {
    "TriggerTime": " ms",
    "FrameReferenceTime": " ms",
    BY_REPETITION: " ms",
    "NominalPercentageOfCardiacPhase": " %",
}


def time_notes(points: Points) -> list[str]:
    """Return a sentence for each thing that a user should know about images at one place."""
    if points.duplicates:
        return [_duplicates(points)]
    first, images = points.whole[0][0], len(points.whole) + len(points.incomplete)
    notes = _lost_points(first, images)
    is_diffusion = first.kind.is_diffusion
    if points.attribute == BY_NUMBER:
        meaning = "directions or b-values of diffusion" if is_diffusion else "time points"
        notes.append(
            f"{images} images at a place: only {BY_NUMBER} separates them, so {meaning} are "
            "assumed; --time picks one"
        )
    elif points.attribute and (is_diffusion or points.attribute == BY_REPETITION):
        meaning = "directions of diffusion" if is_diffusion else "repetition times"
        notes.append(
            f"{images} images at a place are {meaning} (they differ in {points.attribute}) and "
            "count as time points; --time picks one"
        )
    notes += [_incomplete(points)] if points.incomplete else []
    return [*notes, *_renumbered(points)]


def point_name(points: Points, place: int) -> str:
    """Return a time point's name for the user: its number among all, from 1, and its stated value.

    place  index among all time points, in the order of time
    """
    name = f"time point {place + 1}"
    # The number of a volume by ImageIndex is computed, not stated.
    is_stated = points.values and points.attribute != BY_IMAGE_INDEX
    if not is_stated or not 0 <= points.values[place] <= _MOST_SHOWN:
        return name
    value = f"{points.values[place]:g}{_UNITS.get(points.attribute, '')}"
    return f"{name} ({points.attribute} {value})"


def _renumbered(points: Points) -> list[str]:
    """Return a note if `--time` skips time points that lack slices, or that are missing."""
    images = len(points.whole) + len(points.incomplete)
    keys, first = tuple(map(float, range(images))), 0.0
    if points.attribute == BY_POSITION and points.values[-1] <= _MOST_SHOWN:
        keys, first = points.values, min(points.values[0], 1.0)  # DICOM counts time points from 1
    moved = [
        f"--time {time} is {point_name(points, place)}"
        for time, place in enumerate(points.whole_places)
        if keys[place] - first != time
    ]
    if not moved:
        return []
    more = ", ..." if len(moved) > _MOST_COUNTS else ""
    return [
        f"--time counts only complete time points, from 0: {', '.join(moved[:_MOST_COUNTS])}{more}"
    ]


def _duplicates(points: Points) -> str:
    comparison = "the same pixels as"
    if points.differ:
        comparison = agreeing(points.duplicates, "other pixels than", "not all the same pixels as")
    return (
        f"{counted(points.duplicates, 'duplicate slice')} with {comparison} the one that is used: "
        "the first by instance number"
    )


def _incomplete(points: Points) -> str:
    total, places = len(points.whole) + len(points.incomplete), len(points.whole[0])
    counts = ", ".join(str(len(point)) for point in points.incomplete[:_MOST_COUNTS])
    lacking = len(points.incomplete)
    more = ", ..." if lacking > _MOST_COUNTS else ""
    return omission(
        f"{lacking} of {total} time points ({points.attribute})",
        f"slices are missing ({counts}{more} of {places} are there)",
        f"{agreeing(lacking, 'it', 'each')} is a series of `--series list`",
    )


def _lost_points(first: Frame, images: int) -> list[str]:
    """Return a note if the header states more time points than there are."""
    # Each time point of an MR may be a separate series that states the number of all.
    if first.stated.volumes is None or (images == 1 and first.modality != "PT"):
        return []
    count, name = first.stated.volumes
    if count <= images:
        return []
    return [
        f"number of time points: {name} states {count:g}, but there "
        f"{agreeing(images, 'is', 'are')} only {images}: the others are missing (copy the series "
        "again if they were lost)"
    ]
