"""The positions of a stack of parallel planes, and the even, orthogonal grid that holds it.

The layout follows from the planes' positions and orientation alone (ImagePositionPatient and
ImageOrientationPatient), because SliceThickness and SpacingBetweenSlices may hold any value.

1. Planes are sorted along their normal. The median of the gaps decides which gaps are regular.
2. If all gaps are regular or whole multiples of the median (planes are missing), the spacing is
   the mean over the whole length. So the rounding of positions doesn't add up.
3. Otherwise the length is divided into as many gaps as the median fits into it, and all planes in
   between are interpolated.
4. Planes that drift sideways (a tilted gantry) form a sheared stack. They are shifted within their
   planes onto an orthogonal grid. Planes that jump sideways are shifted too, and a note names the
   jump, since no gantry causes one.

References: DICOM PS3.3 C.7.6.2 (Image Plane module).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stereocell.model.counted import agreeing, counted

REGULAR = 0.02  # share of a regular gap by which it may deviate, because positions are rounded
DRIFT = 0.05  # pixels over the whole stack; planes that drift less are not shifted
JUMP = 0.05  # share of a plane's shorter side; a larger unusual sideways step is no gantry tilt
SAME_PLACE = 0.02  # pixels; planes that are closer together count as one place


class NoStackError(Exception):
    """The planes don't form a volume; the text of the error gives the reason."""


@dataclass(frozen=True, slots=True)
class StackLayout:
    """A grid of voxels for a stack of n planes. LPS, mm; voxels are (plane, row, column).

    shape        voxels along each axis of the grid
    spacing_mm   mm between voxels along each axis of the grid
    axes         (3, 3): orthogonal unit vectors along the grid's axes, one per row
    origin_mm    (3,): centre of voxel (0, 0, 0)
    places       (n, 3): each plane's first pixel in voxels of the grid, in rising order
    stack        (4, 4) for column vectors: from (plane, row, column, 1) to mm, for as many planes
                 spread evenly from the first position to the last; sheared if the gantry was tilted
    gaps_mm      (n - 1,): distances along the normal
    missing      number of grid planes without a plane of the stack
    is_even      whether the gaps are whole multiples of the spacing
    tilt_deg     angle between the normal and the line through the planes' first pixels; 0: none
    jump_mm      largest sideways step between neighbours beyond their usual one; 0: no jump
    """

    shape: tuple[int, int, int]
    spacing_mm: tuple[float, float, float]
    axes: NDArray[np.float64]
    origin_mm: NDArray[np.float64]
    places: NDArray[np.float64]
    stack: NDArray[np.float64]
    gaps_mm: NDArray[np.float64]
    missing: int
    is_even: bool
    tilt_deg: float
    jump_mm: float

    @property
    def is_resampled(self) -> bool:
        """Whether the grid's planes differ from the planes of the stack."""
        return self.missing > 0 or not self.is_even or self.tilt_deg > 0

    @property
    def affine(self) -> NDArray[np.float64]:
        """(4, 4) for column vectors: from (plane, row, column, 1) of the grid to mm."""
        matrix = np.eye(4)
        matrix[:3, :3] = (self.axes * np.array(self.spacing_mm)[:, None]).T
        matrix[:3, 3] = self.origin_mm
        return matrix

    @property
    def notes(self) -> tuple[str, ...]:
        """Differences between the grid and the acquired planes, one sentence each."""
        notes = []
        spacing = self.spacing_mm[0]
        if not self.is_even:
            notes.append(
                f"uneven gaps of {self.gaps_mm.min():.4g} to {self.gaps_mm.max():.4g} mm between "
                f"slices: interpolated to {spacing:.4g} mm"
            )
        elif self.missing:
            wide = self.gaps_mm[self.gaps_mm > 1.5 * spacing]
            shown = ", ".join(f"{gap:.4g}" for gap in wide[:6]) + (", ..." if len(wide) > 6 else "")
            total = len(self.gaps_mm) + 1 + self.missing
            notes.append(
                f"{counted(self.missing, 'missing slice')} of {total} "
                f"({self.missing / total:.1%}), {agreeing(len(wide), 'a gap', 'gaps')} of {shown} "
                f"mm among slices {spacing:.4g} mm apart: interpolated"
            )
        if self.jump_mm:
            notes.append(
                f"neighbouring slices jump sideways by up to {self.jump_mm:.3g} mm, which no "
                "gantry tilt explains: each slice lies at its stated position, which may be wrong"
            )
        elif self.tilt_deg:
            notes.append(
                f"gantry tilt of {self.tilt_deg:.3g} degrees: resampled onto an orthogonal grid"
            )
        return tuple(notes)


def normal_of(along_row: ArrayLike, along_column: ArrayLike) -> NDArray[np.float64]:
    """Return the unit normal (3,) of a plane: the cross product of its row and column vectors."""
    normal = np.cross(np.asarray(along_row, np.float64), np.asarray(along_column, np.float64))
    return normal / np.linalg.norm(normal)


def lay_out(
    positions_mm: ArrayLike,
    along_row: ArrayLike,
    *,
    along_column: ArrayLike,
    pixel_spacing_mm: tuple[float, float],
    plane_shape: tuple[int, int],
) -> StackLayout:
    """Return the grid for parallel planes.

    positions_mm      (n, 3): centres of the first pixels, LPS, mm; they rise along the normal, with
                      one plane at each place
    along_row         (3,): unit vector along a row, towards larger column indices
    along_column      (3,): unit vector along a column, towards larger row indices
    pixel_spacing_mm  mm between (rows, columns)
    plane_shape       pixels (rows, columns)

    Raises NoStackError where there are fewer than 2 planes, where planes lie side by side in one
    plane, or where more planes are missing than present.
    """
    positions = np.asarray(positions_mm, np.float64)
    if len(positions) < 2:
        raise NoStackError(f"a volume needs at least 2 slices: found {len(positions)}")
    normal = normal_of(along_row, along_column)
    across = np.asarray(along_row, np.float64)
    down = np.cross(normal, across)  # orthogonal to both, even if the two vectors are rounded
    axes = np.stack([normal, down, across])
    local = (positions - positions[0]) @ axes.T  # mm along (normal, down, across)
    gaps = np.diff(local[:, 0])
    if gaps.min() <= SAME_PLACE * min(pixel_spacing_mm):
        raise NoStackError("slices lie side by side in one plane, not on top of each other")
    count, is_even = _count_planes(gaps)
    lost = count - len(positions)
    if lost > len(positions):
        raise NoStackError(
            f"{lost} of {count} slices {agreeing(lost, 'is', 'are')} missing (gaps of "
            f"{gaps.min():.4g} to {gaps.max():.4g} mm)"
        )
    spacing = local[-1, 0] / (count - 1)
    places = local / np.array([spacing, *pixel_spacing_mm])
    if is_even:
        places[:, 0] = np.rint(places[:, 0])
    sideways = local[-1, 1:]
    tilt = 0.0
    if np.abs(places[:, 1:]).max() > DRIFT:
        tilt = math.degrees(math.atan2(float(np.linalg.norm(sideways)), local[-1, 0]))
        tilt = max(tilt, 1e-3)  # planes that drift and come back are shifted as well
    else:
        places[:, 1:] = 0.0
    low = np.floor(places[:, 1:].min(axis=0) + 1e-6)
    high = np.ceil(places[:, 1:].max(axis=0) - 1e-6)
    places[:, 1:] -= low
    rows, columns = (int(n + b - a) for n, a, b in zip(plane_shape, low, high, strict=True))
    origin = positions[0] + (low * pixel_spacing_mm) @ axes[1:]
    stack = np.eye(4)
    stack[:3, 0] = (positions[-1] - positions[0]) / (count - 1)
    stack[:3, 1] = np.asarray(along_column, np.float64) * pixel_spacing_mm[0]
    stack[:3, 2] = across * pixel_spacing_mm[1]
    stack[:3, 3] = positions[0]
    return StackLayout(
        (count, rows, columns),
        (float(spacing), *pixel_spacing_mm),
        axes,
        origin,
        places,
        stack,
        gaps,
        count - len(positions) if is_even else count,
        is_even,
        tilt,
        _find_jump(local, JUMP * float(np.min(np.multiply(plane_shape, pixel_spacing_mm)))),
    )


def _find_jump(local: NDArray[np.float64], least_mm: float) -> float:
    """Return the largest sideways step beyond the usual drift, mm; 0 if it is below `least_mm`.

    local  (n, 3): positions in mm along the normal and along two axes in the plane
    """
    steps = np.diff(local, axis=0)
    usual = np.median(steps[:, 1:] / steps[:, :1], axis=0)
    jump = float(np.linalg.norm(steps[:, 1:] - usual * steps[:, :1], axis=1).max())
    return jump if jump > least_mm else 0.0


def _count_planes(gaps: NDArray[np.float64]) -> tuple[int, bool]:
    """Return the number of planes of an even grid over these gaps, and whether the gaps fit it."""
    median = float(np.median(gaps))
    steps = np.rint(gaps / median)
    if steps.min() >= 1 and (np.abs(gaps - steps * median) <= REGULAR * median * steps).all():
        return int(steps.sum()) + 1, True
    return max(round(float(gaps.sum()) / median), 1) + 1, False
