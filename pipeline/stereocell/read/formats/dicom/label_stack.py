"""The planes of a segmentation as one label map: a voxel is its segment's number, 0: none.

Segmentations leave out all planes without segments, so gaps between the others don't show the
spacing. The stated spacing is used if all gaps are multiples of it, otherwise the smallest gap.
Planes that are left out are empty, so nothing is interpolated.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.read.formats.dicom.frame import Frame
from stereocell.read.formats.dicom.group_frames import find_groups
from stereocell.read.formats.dicom.pixels import decode, dtype_of
from stereocell.read.formats.dicom.segmentation import BINARY, LABELMAP, Segmentation
from stereocell.read.plane_stack import DRIFT, REGULAR, NoStackError, normal_of

_AT_ONCE = 1 << 28  # pixels that are decoded together; the file is read again for each such part
_MAX_PLANES = 1 << 16
_NEAR = 0.2  # planes; a gap may differ this much from a whole number of planes


@dataclass(frozen=True, slots=True)
class LabelStack:
    """One segmentation's frames on an even grid.

    frames  frames in the order of planes, and on one plane of segments
    planes  index of each frame's plane in the grid
    shape   voxels (plane, row, column)
    affine  (4, 4) for column vectors: from (plane, row, column, 1) to LPS, mm
    """

    segmentation: Segmentation
    frames: tuple[Frame, ...]
    planes: tuple[int, ...]
    shape: tuple[int, int, int]
    affine: NDArray[np.float64]

    @property
    def numbers(self) -> list[int]:
        """The segment numbers of frames of bits, in rising order."""
        return sorted({frame.segment for frame in self.frames})

    @property
    def dtype(self) -> np.dtype[Any]:
        """The dtype of the segment numbers."""
        if self.segmentation.kind == LABELMAP:
            return dtype_of(self.frames)
        return np.min_scalar_type(self.numbers[-1])

    def do_overlap(self, paths: Sequence[Path], shown: str) -> bool:
        """Return whether segments overlap, as stated or by decoding them. Raises SourceError."""
        if self.segmentation.kind == LABELMAP:
            return False
        if self.segmentation.overlap in ("YES", "NO"):
            return self.segmentation.overlap == "YES"
        plane, drawn = -1, np.zeros(0, self.dtype)
        for at, frame, pixels in self._decoded(self.numbers, paths, shown):
            if at != plane:
                plane, drawn = at, np.zeros(pixels.shape, self.dtype)
            if not _draw(drawn, pixels, frame.segment):
                return True
        return False

    def load(
        self, paths: Sequence[Path], shown: str, numbers: Sequence[int]
    ) -> NDArray[np.generic]:
        """Return the label map of these segments (in a LABELMAP, all), (plane, row, column).

        Raises SourceError where a frame can't be decoded, and where segments overlap although the
        file states that they don't.
        """
        volume = np.zeros(self.shape, self.dtype)
        for plane, frame, pixels in self._decoded(numbers, paths, shown):
            if self.segmentation.kind == LABELMAP:
                low, high = frame.encoding.padding or (0, 0)  # numbers of the background
                volume[plane] = np.where((pixels >= low) & (pixels <= high), 0, pixels)
            elif not _draw(volume[plane], pixels, frame.segment):
                raise SourceError(
                    f"{shown}: found segments that overlap, expected none: the file states that "
                    "they don't (SegmentsOverlap NO)"
                )
        return volume

    def _decoded(
        self, numbers: Sequence[int], paths: Sequence[Path], shown: str
    ) -> Iterator[tuple[int, Frame, NDArray[Any]]]:
        """Yield plane, frame and its pixels (rows, columns), plane by plane."""
        pairs = zip(self.planes, self.frames, strict=True)
        wanted = [pair for pair in pairs if pair[1].segment in numbers]
        dtype = dtype_of(self.frames)
        count = max(1, _AT_ONCE // (self.shape[1] * self.shape[2]))
        for some in (wanted[i : i + count] for i in range(0, len(wanted), count)):
            bare = [_without_padding(frame) for _, frame in some]
            for (plane, frame), pixels in zip(some, decode(bare, paths, dtype, shown), strict=True):
                yield plane, frame, pixels


def stack_labels(segmentation: Segmentation, frames: Sequence[Frame]) -> LabelStack:
    """Return the grid of all frames of a segmentation.

    Raises NoStackError for fractions, and where the planes don't form a volume.
    """
    if segmentation.kind not in (BINARY, LABELMAP):
        raise NoStackError("with fractions (FRACTIONAL) instead of bits or numbers")
    if segmentation.kind == BINARY and not all(frame.segment > 0 for frame in frames):
        raise NoStackError("with frames that name no segment")
    groups = find_groups([replace(frame, segment=0, stack=b"") for frame in frames])
    if len(groups) > 1:
        raise NoStackError(f"with planes of {len(groups)} orientations or sizes")
    (group,) = groups
    normal = normal_of(group.along_row, group.along_column)
    across = np.asarray(group.along_row)
    axes = np.stack([normal, np.cross(normal, across), across])
    places = np.array([frame.position for frame in group.frames]) @ axes.T
    first = places[places[:, 0].argmin()].copy()
    places -= first
    if (np.abs(places[:, 1:]) > DRIFT * np.array(group.spacing)).any():
        raise NoStackError("with planes side by side, not on top of each other")
    planes, spacing = _planes(places[:, 0], segmentation.between_mm)
    if segmentation.kind == LABELMAP and len(set(planes)) < len(planes):
        raise NoStackError("with several planes at one place")
    order = sorted(range(len(frames)), key=lambda i: (planes[i], frames[i].segment))
    affine = np.eye(4)
    affine[:3, :3] = (axes * np.array([spacing, *group.spacing])[:, None]).T
    affine[:3, 3] = first @ axes
    return LabelStack(
        segmentation,
        tuple(frames[i] for i in order),
        tuple(planes[i] for i in order),
        # a volume has at least two planes
        (max(planes[order[-1]] + 1, 2), frames[0].rows, frames[0].columns),
        affine,
    )


def _planes(heights_mm: NDArray[np.float64], stated_mm: float) -> tuple[list[int], float]:
    """Return each frame's plane, from 0, and the spacing in mm."""
    gaps = np.diff(np.unique(heights_mm))
    least = REGULAR * (stated_mm or gaps.max(initial=0))
    gaps = gaps[gaps > least]  # smaller gaps lie between frames on one plane
    if not len(gaps) and not stated_mm:
        raise NoStackError("with one plane and without SpacingBetweenSlices")
    for step in (stated_mm, float(gaps.min(initial=np.inf))):
        if not 0 < step < np.inf:
            continue
        exact = heights_mm / step
        planes = np.rint(exact)
        last = float(planes.max())
        if last:  # the rounding of a stated spacing would add up from plane to plane
            step = float(heights_mm.max()) / last
            exact = heights_mm / step
            planes = np.rint(exact)
        if last < _MAX_PLANES and (np.abs(exact - planes) <= _NEAR).all():
            return [int(plane) for plane in planes], step
    raise NoStackError("with uneven gaps between planes")


def _draw(numbers: NDArray[Any], pixels: NDArray[Any], segment: int) -> bool:
    """Write a segment into a plane (rows, columns). Returns False if it overlaps another one."""
    is_drawn = pixels > 0
    there = numbers[is_drawn]
    numbers[is_drawn] = segment
    return not ((there != 0) & (there != segment)).any()


def _without_padding(frame: Frame) -> Frame:
    return replace(frame, encoding=replace(frame.encoding, padding=None))
