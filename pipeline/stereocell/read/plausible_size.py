"""Sizes of a patient's image that no scanner has: their unit is likely another one."""

from collections.abc import Sequence

_WIDEST_MM = 12.0  # mm between voxels; PET and SPECT have up to 10 mm
_LEAST_MM = 1.0  # mm across a whole volume


def size_notes(spacing_mm: Sequence[float], shape: Sequence[int]) -> tuple[str, ...]:
    """Return a note where a volume is implausibly coarse or small for its unit.

    spacing_mm, shape  along the same three axes
    """
    finest = min(spacing_mm)
    across = max(n * h for n, h in zip(shape, spacing_mm, strict=True))
    if finest > _WIDEST_MM:
        found = f"found {finest:.5g} mm along the finest axis, where scanners have up to 12 mm"
    elif across < _LEAST_MM:
        found = f"found {across:.3g} mm across the whole volume, where scanners have over 1 mm"
    else:
        return ()
    return (f"voxel spacing: {found}: is its unit another one? (--spacing-um z,y,x replaces it)",)
