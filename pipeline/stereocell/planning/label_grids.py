"""Lay the grid of a label map on its image: find its spacing and place, and how much it covers.

Both files state a grid, and the grids may contradict each other. If the label map has as many
voxels as the image, it has one number for each voxel of the image, whatever spacing it states.
"""

from collections.abc import Iterator

import numpy as np

from stereocell.model.errors import SourceError
from stereocell.model.rigid_transform import IDENTITY
from stereocell.read.dataset import Dataset
from stereocell.read.statements import Statement, Subject, Trust, settle

_MAX_ROUNDING = 1e-6  # elements of two rotation matrices that differ by less are equal
_HALF = 0.5  # voxels; smaller differences between two grids come from rounding
_NOUNS = ("plane{} (z)", "row{} (y)", "column{} (x)")
# Words for images that lie in a patient: their canonical axes are not planes, rows and columns.
_TURNED = ("voxel{} along z", "voxel{} along y", "voxel{} along x")
_SPACING = Subject("voxel spacing (z, y, x)", "um")

Triple = tuple[float, float, float]


def origin_on(image: Dataset, labels: Dataset) -> Triple:
    """Return the centre of the labels' first voxel from that of the image's, (z, y, x) in um.

    Raises SourceError if the labels are rotated to the image, or if their orientation on it is not
    known.
    """
    if _ways_round(image) != _ways_round(labels):
        raise SourceError(
            f"{labels.shown}: found {_ways_round(labels)}, expected {_ways_round(image)} as in the "
            "image: save both in one format, such as NIfTI or TIFF"
        )
    if image.has_sides or image.placement != IDENTITY:
        between = np.linalg.inv(np.array(image.placement)) @ np.array(labels.placement)
        if np.abs(between[:3, :3] - np.eye(3)).max() > _MAX_ROUNDING:
            raise SourceError(
                f"{labels.shown}: is rotated to the image, expected labels along the image's axes"
            )
        x, y, z = (float(part) for part in between[:3, 3])
        return z, -y, x
    if labels.levels[0].shape == image.levels[0].shape and not any(labels.offset_um):
        return 0.0, 0.0, 0.0  # without a stated place, labels of equal shape lie on the same voxels
    places = zip(labels.offset_um, image.offset_um, strict=True)
    z, y, x = (own - first for own, first in places)
    return z, y, x


def _ways_round(dataset: Dataset) -> str:
    """Return how a reader found the orientation of a dataset's axes, for messages."""
    if dataset.has_sides:
        return "axes by a patient's sides"
    return "its file's own axes" if dataset.placement == IDENTITY else "axes by guessed sides"


def has_other_spacing(image: Dataset, labels: Dataset) -> bool:
    """Return whether labels have as many voxels as the image, but state another spacing.

    Images of patients return False: they state their whole geometry, which is used.
    """
    one, other = image.levels[0], labels.levels[0]
    if one.shape != other.shape or image.placement != IDENTITY or labels.placement != IDENTITY:
        return False
    pairs = zip(one.shape, one.spacing_um, other.spacing_um, strict=True)
    return any(n * abs(a - b) > _HALF * min(a, b) for n, a, b in pairs)


def settle_spacing(image: Dataset, labels: Dataset) -> tuple[str, ...]:
    """Return the notes on labels whose file states another spacing than the image."""
    statements = [
        Statement(image.levels[0].spacing_um, "the image, which has as many voxels,"),
        Statement(labels.levels[0].spacing_um, "the labels' file", Trust.REPEATED),
    ]
    return settle(_SPACING, statements).notes


def note_on_assumed(image: Dataset, level: int) -> str:
    """Return the note on labels without a voxel size, which take that of a level of equal shape."""
    reason = f"as resolution level {level} of the image has as many voxels"
    assumed = Statement(image.levels[level].spacing_um, reason, Trust.ASSUMED)
    return settle(_SPACING, [assumed]).notes[0]


def require_overlap(image: Dataset, labels: Dataset, origin_um: Triple) -> None:
    """Raise SourceError if labels and image do not overlap, because one states a wrong place."""
    if any(high <= low for low, high in _shared(image, labels, origin_um)):
        first = ", ".join(f"{part:g}" for part in origin_um)
        raise SourceError(
            f"{labels.shown}: lies beside the image: found its first voxel at {first} um (z, y, x) "
            "from the image's, expected labels of that image"
        )


def note_on_cover(image: Dataset, labels: Dataset, origin_um: Triple) -> str:
    """Return the note on labels that cover only a part of the image, or reach beyond it."""
    parts = list(_uncovered(image, labels, origin_um))
    beyond = list(_beyond(image, labels, origin_um))
    notes = [f"cover {' and '.join(parts)} of the image"] if parts else []
    notes += [f"reach {' and '.join(beyond)} of the image"] if beyond else []
    if not notes:
        return ""
    states_place = image.placement != IDENTITY or any(labels.offset_um)
    assumed = (
        ""
        if states_place
        else (
            "; their file states no place, so they start at the image's first voxel: labels of a "
            "crop must state its place, for example as a translation in OME-Zarr"
        )
    )
    return f"{'; '.join(notes)}{assumed}"


def _shared(image: Dataset, labels: Dataset, origin_um: Triple) -> Iterator[tuple[float, float]]:
    """Yield the ends of the overlap of both grids along z, y and x, in voxels of the image."""
    finest, own = image.levels[0], labels.levels[0]
    for axis in range(3):
        step, spacing, n = finest.spacing_um[axis], own.spacing_um[axis], own.shape[axis]
        low = (origin_um[axis] - _HALF * spacing) / step + _HALF
        yield max(low, 0.0), min(low + n * spacing / step, float(finest.shape[axis]))


def _uncovered(image: Dataset, labels: Dataset, origin_um: Triple) -> Iterator[str]:
    """Yield the covered part of the image along each axis that is not covered completely."""
    finest = image.levels[0]
    for axis, (low, high) in enumerate(_shared(image, labels, origin_um)):
        n, slack = finest.shape[axis], _slack(image, labels, axis)
        if low > slack or n - high > slack:
            first, last = round(low), round(high)
            noun = _nouns(image)[axis].format("s")
            yield f"{last - first} of {n} {noun}, {first} to {last - 1},"


def _beyond(image: Dataset, labels: Dataset, origin_um: Triple) -> Iterator[str]:
    """Yield the length by which labels reach beyond each side of the image."""
    finest, own = image.levels[0], labels.levels[0]
    for axis, noun in enumerate(_nouns(image)):
        step, spacing, n = finest.spacing_um[axis], own.spacing_um[axis], own.shape[axis]
        low = origin_um[axis] - _HALF * spacing + _HALF * step
        ends = {"first": -low, "last": low + n * spacing - finest.shape[axis] * step}
        for end, length in ends.items():
            if length > _slack(image, labels, axis) * step:
                yield f"{length:.4g} um beyond the {end} {noun.format('')}"


def _nouns(image: Dataset) -> tuple[str, ...]:
    return _NOUNS if image.placement == IDENTITY else _TURNED


def _slack(image: Dataset, labels: Dataset, axis: int) -> float:
    """Return by how many voxels of the image the ends may differ.

    The sizes of coarse levels are rounded, so a coarse label map may be a little longer.
    """
    ratio = labels.levels[0].spacing_um[axis] / image.levels[0].spacing_um[axis]
    return max(_HALF, ratio - 1) + 1e-6
