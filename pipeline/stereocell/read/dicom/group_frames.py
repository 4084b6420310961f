"""Group DICOM frames into stacks: equal in all stated attributes, and parallel.

Decimal strings are rounded, in each slice anew, so pixel spacings and orientations that differ by
rounding count as equal. They are compared with the group's mean, so that a wobble about it
keeps the frames together, and the mean is the stack's. A plane is turned into the mean orientation
about its first pixel, which has a stated place, or about its middle: the pivot that gives the more
even steps is taken, since a wobble moves the one and not the other.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from stereocell.model.counted import agreeing, counted
from stereocell.read.dicom.bed_positions import join_beds
from stereocell.read.dicom.frame import Frame, Vector
from stereocell.read.dicom.rounded_positions import restore_positions
from stereocell.read.dicom.split_kinds import split_kinds
from stereocell.read.plane_stack import SAME_PLACE, NoStackError, lay_out

PARALLEL = 2e-3  # rad: planes that differ more in orientation belong to different stacks
ALIKE = 1e-3  # share of the pixel spacing: half a pixel over 512 pixels
_LEAST_JOINED = 3  # fewest slices of different frames of reference that show a regular stack
_SAME_WAY = np.cos(np.radians(5.0))  # cosine; stacks whose normals are closer can interleave

# attributes that separate stacks: field of Frame, name in the standard
_STATED: tuple[tuple[str, str], ...] = (
    ("series", "SeriesInstanceUID"),
    ("reference", "FrameOfReferenceUID"),
    ("stack", "StackID"),
    ("segment", "ReferencedSegmentNumber"),
    ("modality", "Modality"),
    ("rows", "Rows"),
    ("columns", "Columns"),
)


class Group:
    """Frames of one stack, in the order of insertion."""

    def __init__(self, first: Frame) -> None:
        self.frames = [first]
        self.words: tuple[str, ...] = ()  # of the properties that separate it from other groups
        self.order: tuple[int, ...] = ()  # sorts it among those
        self.notes: tuple[str, ...] = ()
        self.unjoined = ""  # why slices of a frame of reference each are not one stack
        self._directions = _directions(first)
        self._spacing = np.array(first.spacing)
        self._is_exact = True  # all frames state the same: no mean, which rounds

    def takes(self, frame: Frame) -> bool:
        """Return whether a frame with equal attributes matches in orientation and pixel spacing."""
        return not (_turns(self._mean_directions, _directions(frame)) or self._is_other(frame))

    def add(self, frame: Frame) -> None:
        """Add a frame for which `takes` is true."""
        first = self.frames[0]
        self._is_exact &= (
            frame.along_row == first.along_row
            and frame.along_column == first.along_column
            and frame.spacing == first.spacing
        )
        self.frames.append(frame)
        self._directions = self._directions + _directions(frame)
        self._spacing = self._spacing + frame.spacing

    def straighten(self) -> None:
        """Turn the planes into the mean orientation; call it after the last `add`."""
        if self._is_exact or len(self.frames) < 3:
            return
        first = self.frames[0]
        to_middle = (np.array([first.columns, first.rows]) - 1) / 2 * self.spacing[::-1]
        corners = np.array([frame.position for frame in self.frames])
        middles = corners + [to_middle @ _directions(frame) for frame in self.frames]
        normal = _axes(self)[0]
        if _unevenness(middles, normal) < _unevenness(corners, normal):
            corners = middles - to_middle @ self._mean_directions
            self.frames = [
                replace(frame, position=_vector(corner))
                for frame, corner in zip(self.frames, corners, strict=True)
            ]

    @property
    def along_row(self) -> Vector:
        """The mean, a unit vector, as is `along_column`."""
        return self.frames[0].along_row if self._is_exact else _vector(self._mean_directions[0])

    @property
    def along_column(self) -> Vector:
        """The mean, a unit vector of growing row index."""
        if self._is_exact:
            return self.frames[0].along_column
        return _vector(self._mean_directions[1])

    @property
    def spacing(self) -> tuple[float, float]:
        """The mean, mm between (rows, columns)."""
        if self._is_exact:
            return self.frames[0].spacing
        rows, columns = (self._spacing / len(self.frames)).tolist()
        return rows, columns

    @property
    def _mean_directions(self) -> NDArray[np.float64]:
        lengths = np.linalg.norm(self._directions, axis=1, keepdims=True)
        return np.asarray(self._directions / lengths)

    def _is_other(self, frame: Frame) -> bool:
        mean = self._spacing / len(self.frames)
        return bool((np.abs(frame.spacing - mean) > ALIKE * mean).any())

    def differences(self, other: "Group") -> list[str]:
        """Return the attributes that differ from another stack's, in the standard's words."""
        a, b = self.frames[0], other.frames[0]
        found = [word for name, word in _STATED if getattr(a, name) != getattr(b, name)]
        mean, step = np.array(other.spacing), ALIKE * np.array(self.spacing)
        if (np.abs(mean - self.spacing) > step).any():
            found.append("PixelSpacing")
        if _turns(self._mean_directions, other._mean_directions):
            found.append("ImageOrientationPatient")
        return found

    def interleaves(self, other: "Group") -> bool:
        """Return whether these planes lie, at least in part, between the other stack's."""
        axes = _axes(self)
        if abs(axes[0] @ _axes(other)[0]) < _SAME_WAY:
            return False
        ours, theirs = self._box(axes), other._box(axes)
        shared = np.minimum(ours[1], theirs[1]) - np.maximum(ours[0], theirs[0])
        return bool(shared[0] >= 0 and (shared[1:] > 0).all())  # a single plane is not thick

    def _box(self, axes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return lowest and highest place (2, 3), mm along the axes (3, 3), one a row."""
        first = self.frames[0]
        size = np.array(self.spacing) * (first.rows, first.columns)
        corner = _directions(first)[::-1] * size[:, None]  # down the rows, then along them
        positions = np.array([frame.position for frame in self.frames])
        places = np.concatenate([positions, positions + corner.sum(axis=0)]) @ axes.T
        return np.stack([places.min(axis=0), places.max(axis=0)])


def find_groups(frames: Iterable[Frame]) -> list[Group]:
    """Return the frames by stack."""
    groups: dict[tuple[object, ...], list[Group]] = {}
    for frame in frames:
        alike = groups.setdefault(_key(frame), [])
        group = next((group for group in alike if group.takes(frame)), None)
        if group is None:
            alike.append(Group(frame))
        else:
            group.add(frame)
    whole = _join_references([group for alike in groups.values() for group in alike])
    found = [part for group in whole for part in _parts(group)]
    for group in found:
        group.frames, notes = restore_positions(group.frames, _axes(group)[0])
        group.notes += notes
        group.straighten()
    return found


def _key(frame: Frame) -> tuple[object, ...]:
    return (*(getattr(frame, name) for name, _ in _STATED), frame.kind.part, frame.kind.role)


def _group(frames: Iterable[Frame]) -> Group:
    """Return a group of frames that match."""
    first, *others = frames
    group = Group(first)
    for frame in others:
        group.add(frame)
    return group


def _join_references(groups: list[Group]) -> list[Group]:
    """Join slices whose frames of reference change along the stack, as after de-identification.

    They are one stack where all else is equal and the positions of all of them are regular.
    """
    alike: dict[tuple[object, ...], list[list[Group]]] = {}
    for group in groups:
        first = replace(group.frames[0], reference=b"")
        families = alike.setdefault(_key(first), [])
        family = next((f for f in families if f[0].takes(first)), None)
        if family is None:
            families.append([group])
        else:
            family.append(group)
    return [one for families in alike.values() for family in families for one in _joined(family)]


def _joined(family: list[Group]) -> list[Group]:
    if len(family) < _LEAST_JOINED:
        return family
    joined = _group([frame for group in family for frame in group.frames])
    places, runs = _runs(family, joined)
    are_single = all(low == high for low, high in runs)
    reason = _irregularity(joined, places, are_single=are_single)
    # Points in time share a place, which is fine; runs that share several places are volumes apart.
    overlap = any(b[0] <= a[1] and not (a == b and a[0] == a[1]) for a, b in pairwise(sorted(runs)))
    if reason or overlap:
        for group in family:
            group.unjoined = reason
        return family
    slices = (
        f"each of {len(family)} slices has a FrameOfReferenceUID of its own"
        if are_single
        else f"{len(places)} slices have {len(family)} FrameOfReferenceUIDs, one after the other"
    )
    joined.notes = (
        f"{slices}, as after de-identification: joined, since series, orientation and spacings are "
        "the same and the positions are regular",
    )
    return [joined]


def _runs(family: list[Group], joined: Group) -> tuple[list[Vector], list[tuple[int, int]]]:
    """Return the places of all frames, rising, and the first and last one of each group."""
    normal = _axes(joined)[0]
    near = SAME_PLACE * min(joined.spacing)
    numbered = [(frame, number) for number, group in enumerate(family) for frame in group.frames]
    places: list[Vector] = []
    found: list[list[int]] = [[] for _ in family]
    for frame, number in sorted(numbered, key=lambda one: float(normal @ one[0].position)):
        if not places or np.linalg.norm(np.subtract(frame.position, places[-1])) > near:
            places.append(frame.position)
        found[number].append(len(places) - 1)
    return places, [(min(indices), max(indices)) for indices in found]


def _irregularity(joined: Group, places: list[Vector], *, are_single: bool) -> str:
    """Return why these places are no regular stack; empty: they are one.

    are_single  each slice has a frame of reference of its own: slices between may be missing
    """
    first = joined.frames[0]
    try:
        layout = lay_out(
            places,
            joined.along_row,
            along_column=joined.along_column,
            pixel_spacing_mm=joined.spacing,
            plane_shape=(first.rows, first.columns),
        )
    except NoStackError as error:
        return str(error)
    if layout.jump_mm:
        return f"a sideways jump of {layout.jump_mm:.3g} mm between neighbouring positions"
    if not layout.is_even or (layout.missing and not are_single):
        gaps = layout.gaps_mm
        return f"irregular positions (gaps of {gaps.min():.3g} to {gaps.max():.3g} mm)"
    return ""


def _parts(group: Group) -> list[Group]:
    """Return the group, or one for each kind of frame in it."""
    normal, near = _axes(group)[0], SAME_PLACE * min(group.spacing)
    parts = split_kinds(group.frames, normal, near)
    found = []
    for part in parts:
        frames, notes = join_beds(part.frames, normal, near)
        if len(parts) == 1 and not notes:
            return [group]
        small = _group(frames)
        small.words, small.order, small.notes = part.words, part.order, (*group.notes, *notes)
        found.append(small)
    return found


def describe_neighbours(group: Group, groups: Sequence[Group]) -> tuple[str, ...]:
    """Return a sentence, or none, about other stacks of the series between a group's planes."""
    among = [other for other in _others(group, groups) if group.interleaves(other)]
    return _describe(group, among, "among")


def describe_elsewhere(group: Group, groups: Sequence[Group]) -> tuple[str, ...]:
    """Return a sentence, or none, about other stacks of the series beside a group's planes."""
    beside = [
        other
        for other in _others(group, groups)
        if other.frames[0].kind.words == group.frames[0].kind.words and not group.interleaves(other)
    ]
    return _describe(group, beside, "beside")


def _others(group: Group, groups: Sequence[Group]) -> list[Group]:
    """Return the stacks of the series that differ in an attribute, not only in their kind."""
    first = group.frames[0]
    if len(group.frames) < 2 or first.segmentation is not None:
        return []
    return [
        other
        for other in groups
        if other is not group
        and other.frames[0].series == first.series
        and group.differences(other)
    ]


def _describe(group: Group, others: Sequence[Group], where: str) -> tuple[str, ...]:
    if not others:
        return ()
    images = sum(len(other.frames) for other in others)
    apart = sorted({word for other in others for word in group.differences(other)})
    return (
        counted(images, "more image of the same series lies", "more images of the same series lie")
        + f" {where} these and {agreeing(images, 'is', 'are')} not built: another "
        f"{', '.join(apart)} (`--series list` shows {agreeing(images, 'it', 'them')})",
    )


def _unevenness(points: NDArray[np.float64], normal: NDArray[np.float64]) -> float:
    """Return the sum of squared changes between steps from point to point (n, 3) along a normal."""
    rising = points[np.argsort(points @ normal)]
    return float((np.diff(rising, 2, axis=0) ** 2).sum())


def _directions(frame: Frame) -> NDArray[np.float64]:
    return np.array([frame.along_row, frame.along_column])


def _turns(a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    """Return whether directions (2, 3) differ by more than rounding; chord = angle (rad)."""
    return bool(np.linalg.norm(a - b, axis=1).max() > PARALLEL)


def _axes(group: Group) -> NDArray[np.float64]:
    """Return unit vectors (3, 3) along the normal, down the rows and along them."""
    across = np.array(group.along_row)
    normal = np.cross(across, group.along_column)
    normal /= np.linalg.norm(normal)
    return np.stack([normal, np.cross(normal, across), across])


def _vector(values: NDArray[np.float64]) -> Vector:
    x, y, z = values.tolist()
    return x, y, z
