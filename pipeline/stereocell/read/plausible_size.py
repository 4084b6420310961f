"""Notes on voxel sizes that no instrument has, which are likely due to a wrong unit."""

from collections.abc import Sequence

_WIDEST_MM = 12.0  # mm; a note is written if the finest spacing is wider. PET has up to 10
_LEAST_MM = 1.0  # mm; a note is written if the longest edge of a volume is shorter

_LONGEST_PIXEL = 30.0  # length of a pixel over its width; OCT and line scans reach about 10
_THICKEST_SLICE = 300.0  # distance between slices over the length of a pixel; sections reach 100
_THINNEST_SLICE = 1 / 30.0  # least such ratio; oversampled light-sheet stacks reach 1/4
_QUESTION = "is the unit of one of them wrong? (--spacing-um z,y,x replaces it)"


def ratio_notes(spacing_um: Sequence[float], slice_axis: int) -> tuple[str, ...]:
    """Return a note if voxels are implausibly longer along one axis than along another.

    spacing_um  (z, y, x)
    slice_axis  0, 1 or 2 for z, y or x: the axis that is perpendicular to the images
    """
    rows, columns = (n for n in range(3) if n != slice_axis)
    long, short = sorted((rows, columns), key=lambda n: -spacing_um[n])
    ratio = spacing_um[long] / spacing_um[short]
    if ratio > _LONGEST_PIXEL:
        found = f"pixels {ratio:.0f} times as long along {'zyx'[long]} as along {'zyx'[short]}"
        return (f"voxel spacing: found {found}: {_QUESTION}",)
    in_plane = (spacing_um[rows] * spacing_um[columns]) ** 0.5
    ratio = spacing_um[slice_axis] / in_plane
    if _THINNEST_SLICE <= ratio <= _THICKEST_SLICE:
        return ()
    found = f"slices {spacing_um[slice_axis]:.3g} um apart along {'zyx'[slice_axis]}"
    return (f"voxel spacing: found {found} with pixels of {in_plane:.3g} um: {_QUESTION}",)


def size_notes(spacing_mm: Sequence[float], shape: Sequence[int]) -> tuple[str, ...]:
    """Return a note if a volume is implausibly coarse or small for its unit.

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
    return (f"voxel spacing: {found}: is its unit wrong? (--spacing-um z,y,x replaces it)",)
