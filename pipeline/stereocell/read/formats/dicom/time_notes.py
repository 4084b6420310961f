"""Notes for the user on several images at one place: points in time, directions, duplicates."""

from stereocell.model.counted import agreeing, counted
from stereocell.read.formats.dicom.frame import Frame
from stereocell.read.formats.dicom.points_in_time import (
    BY_IMAGE_INDEX,
    BY_NUMBER,
    BY_POSITION,
    BY_REPETITION,
    Points,
)
from stereocell.read.statements import omission

_MOST_COUNTS = 4  # most points that a note lists one by one
_MOST_SHOWN = 9999  # larger values of an attribute are not shown: they may be dates
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
        what = "directions or b-values of diffusion" if is_diffusion else "points in time"
        notes.append(
            f"{images} images at a place: {BY_NUMBER} alone tells them apart, {what} are assumed; "
            "--time picks one"
        )
    elif points.attribute and (is_diffusion or points.attribute == BY_REPETITION):
        what = "directions of diffusion" if is_diffusion else "repetition times"
        notes.append(
            f"{images} images at a place are {what} ({points.attribute} tells them apart) and "
            "count as points in time; --time picks one"
        )
    notes += [_incomplete(points)] if points.incomplete else []
    return [*notes, *_renumbered(points)]


def point_name(points: Points, place: int) -> str:
    """Return a point's name for the user: its number among all, from 1, and its stated value.

    place  among all points, in the order of time
    """
    name = f"point in time {place + 1}"
    # the number of a volume by ImageIndex is computed, and stated nowhere
    is_stated = points.values and points.attribute != BY_IMAGE_INDEX
    if not is_stated or not 0 <= points.values[place] <= _MOST_SHOWN:
        return name
    value = f"{points.values[place]:g}{_UNITS.get(points.attribute, '')}"
    return f"{name} ({points.attribute} {value})"


def _renumbered(points: Points) -> list[str]:
    """Return a note where `--time` counts on over points that lack slices, or that are absent."""
    images = len(points.whole) + len(points.incomplete)
    keys, first = tuple(map(float, range(images))), 0.0
    if points.attribute == BY_POSITION and points.values[-1] <= _MOST_SHOWN:
        keys, first = points.values, min(points.values[0], 1.0)  # the standard counts from 1
    moved = [
        f"--time {time} is {point_name(points, place)}"
        for time, place in enumerate(points.whole_places)
        if keys[place] - first != time
    ]
    if not moved:
        return []
    more = ", ..." if len(moved) > _MOST_COUNTS else ""
    return [f"--time counts whole points alone, from 0: {', '.join(moved[:_MOST_COUNTS])}{more}"]


def _duplicates(points: Points) -> str:
    what = "the same pixels as"
    if points.differ:
        what = agreeing(points.duplicates, "other pixels than", "not all the same pixels as")
    return (
        f"{counted(points.duplicates, 'duplicate slice')} with {what} the one that is taken: "
        "the first by instance number"
    )


def _incomplete(points: Points) -> str:
    total, places = len(points.whole) + len(points.incomplete), len(points.whole[0])
    counts = ", ".join(str(len(point)) for point in points.incomplete[:_MOST_COUNTS])
    lacking = len(points.incomplete)
    more = ", ..." if lacking > _MOST_COUNTS else ""
    return omission(
        f"{lacking} of {total} points in time ({points.attribute})",
        f"slices are missing ({counts}{more} of {places} are there)",
        f"{agreeing(lacking, 'it', 'each')} is a series of `--series list`",
    )


def _lost_points(first: Frame, images: int) -> list[str]:
    """Return a note where the header states more points in time than there are."""
    # each point of an MR may be a series of its own, of which one states the number of all
    if first.stated.volumes is None or (images == 1 and first.modality != "PT"):
        return []
    count, name = first.stated.volumes
    if count <= images:
        return []
    return [
        f"number of points in time: {name} states {count:g}, and {images} "
        f"{agreeing(images, 'is', 'are')} there: the others are absent (copy the series again if "
        "they were lost)"
    ]
