"""Notes for the user on several images at one place: points in time, directions, duplicates."""

from stereocell.model.counted import agreeing, counted
from stereocell.read.dicom.frame import Frame
from stereocell.read.dicom.points_in_time import BY_NUMBER, BY_REPETITION, Points
from stereocell.read.statements import omission

_MOST_COUNTS = 4  # most incomplete points whose slices are counted one by one


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
    return [*notes, *([_incomplete(points)] if points.incomplete else [])]


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
