"""A group of DICOM frames that are parallel and equal in all attributes that separate stacks.

Each slice rounds its own decimal strings, so pixel spacings and orientations that differ only by
rounding count as equal. They are compared with the group's mean, so that a wobble around it keeps
the frames together; the mean is used for the stack. A plane is turned into the mean orientation
around its first pixel, whose position is stated, or around its middle. The pivot that gives the
more even steps is used, since a wobble moves only one of the two.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stereocell.read.formats.dicom.frame import Frame, Vector

PARALLEL = 2e-3  # rad; planes that differ more in orientation belong to different stacks
ALIKE = 1e-3  # share of the pixel spacing by which two may differ: half a pixel over 512 pixels
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
        self.words: tuple[str, ...] = ()  # words for its difference from other groups of the series
        self.order: tuple[int, ...] = ()  # key that sorts it among the groups of the series
        self.notes: tuple[str, ...] = ()
        self.unjoined = ""  # why slices with different UIDs were not joined to one stack
        self._directions = _directions(first)
        self._spacing = np.array(first.spacing)
        # True while all frames state the same values, so that no mean, which rounds, is needed
        self._is_exact = True

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
        """Turn the planes into the mean orientation. Call it after the last `add`."""
        if self._is_exact or len(self.frames) < 3:
            return
        first = self.frames[0]
        to_middle = (np.array([first.columns, first.rows]) - 1) / 2 * self.spacing[::-1]
        corners = np.array([frame.position for frame in self.frames])
        middles = corners + [to_middle @ _directions(frame) for frame in self.frames]
        normal = axes_of(self)[0]
        if _unevenness(middles, normal) < _unevenness(corners, normal):
            corners = middles - to_middle @ self._mean_directions
            self.frames = [
                replace(frame, position=_vector(corner))
                for frame, corner in zip(self.frames, corners, strict=True)
            ]

    @property
    def along_row(self) -> Vector:
        """Mean unit vector along a row, towards larger column indices."""
        return self.frames[0].along_row if self._is_exact else _vector(self._mean_directions[0])

    @property
    def along_column(self) -> Vector:
        """Mean unit vector along a column, towards larger row indices."""
        if self._is_exact:
            return self.frames[0].along_column
        return _vector(self._mean_directions[1])

    @property
    def spacing(self) -> tuple[float, float]:
        """Mean of the mm between (rows, columns)."""
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
        """Return the standard's names of the attributes that differ from another stack's."""
        a, b = self.frames[0], other.frames[0]
        found = [word for name, word in _STATED if getattr(a, name) != getattr(b, name)]
        mean, step = np.array(other.spacing), ALIKE * np.array(self.spacing)
        if (np.abs(mean - self.spacing) > step).any():
            found.append("PixelSpacing")
        if _turns(self._mean_directions, other._mean_directions):
            found.append("ImageOrientationPatient")
        return found

    def interleaves(self, other: "Group") -> bool:
        """Return whether these planes lie, at least in part, between the other stack's planes."""
        axes = axes_of(self)
        if abs(axes[0] @ axes_of(other)[0]) < _SAME_WAY:
            return False
        ours, theirs = self._box(axes), other._box(axes)
        shared = np.minimum(ours[1], theirs[1]) - np.maximum(ours[0], theirs[0])
        return bool(shared[0] >= 0 and (shared[1:] > 0).all())  # a single plane has no thickness

    def _box(self, axes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return lowest and highest position (2, 3), mm along the axes (3, 3), one per row."""
        first = self.frames[0]
        size = np.array(self.spacing) * (first.rows, first.columns)
        corner = _directions(first)[::-1] * size[:, None]  # mm: a plane's column, then its row
        positions = np.array([frame.position for frame in self.frames])
        places = np.concatenate([positions, positions + corner.sum(axis=0)]) @ axes.T
        return np.stack([places.min(axis=0), places.max(axis=0)])


def key_of(frame: Frame) -> tuple[object, ...]:
    """Return the attributes and the kind that must be equal in one group."""
    return (*(getattr(frame, name) for name, _ in _STATED), frame.kind.part, frame.kind.role)


def group_of(frames: Iterable[Frame]) -> Group:
    """Return a group of frames that match."""
    first, *others = frames
    group = Group(first)
    for frame in others:
        group.add(frame)
    return group


def _unevenness(points: NDArray[np.float64], normal: NDArray[np.float64]) -> float:
    """Return the sum of squared changes between steps from point to point (n, 3) along a normal."""
    rising = points[np.argsort(points @ normal)]
    return float((np.diff(rising, 2, axis=0) ** 2).sum())


def _directions(frame: Frame) -> NDArray[np.float64]:
    return np.array([frame.along_row, frame.along_column])


def _turns(a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    """Return whether unit vectors (2, 3) differ by more than rounding.

    The distance between two unit vectors is nearly the angle between them in rad.
    """
    return bool(np.linalg.norm(a - b, axis=1).max() > PARALLEL)


def axes_of(group: Group) -> NDArray[np.float64]:
    """Return unit vectors (3, 3) along the normal, down the rows and along them."""
    across = np.array(group.along_row)
    normal = np.cross(across, group.along_column)
    normal /= np.linalg.norm(normal)
    return np.stack([normal, np.cross(normal, across), across])


def _vector(values: NDArray[np.float64]) -> Vector:
    x, y, z = values.tolist()
    return x, y, z
