"""Voxel spacings of a patient's image that no scanner has: their unit is likely another one."""

from collections.abc import Sequence

_WIDEST_MM = 12.0  # mm; PET and SPECT have voxels of up to 10 mm
_FINEST_MM = 1e-5  # mm; 10 nm, below the resolution of any light


def size_notes(spacing_mm: Sequence[float]) -> tuple[str, ...]:
    """Return a note where the finest of three voxel spacings is implausible for its unit."""
    finest = min(spacing_mm)
    if _FINEST_MM <= finest <= _WIDEST_MM:
        return ()
    usual, named = ("at most 12 mm", "um") if finest > _WIDEST_MM else ("at least 10 nm", "mm")
    return (
        f"voxel spacing: found {finest:.5g} mm along the finest axis, where images of a patient "
        f"have {usual}: is it in {named}? (--spacing-um z,y,x replaces it)",
    )
