"""Compare the stated spacing of each coarser level with the spacing that its shape implies.

All levels of a pyramid cover the same field: a level of half as many voxels has voxels twice as
long. Where the stated spacing contradicts that and the shape implies a whole factor, the shape
decides, because the number of voxels is certain. Any other level keeps its stated spacing.
"""

from collections.abc import Sequence
from dataclasses import replace

from stereocell.read.spacing import Grid, Triple
from stereocell.read.statements import Statement, Subject, Trust, settle

_ROUNDING = 1.0 + 1e-6  # voxels by which repeated rounding may change the length of a level


def settle_levels(grids: Sequence[Grid]) -> tuple[tuple[Grid, ...], tuple[str, ...]]:
    """Return grids whose spacings agree with their shapes, and a note on each change."""
    settled, notes = [grids[0]], list[str]()
    for index, grid in enumerate(grids[1:], start=1):
        spacing = list(grid.spacing_um or ())
        offset = list(grid.offset_um or ())
        for axis in range(len(spacing)):
            found = _contradiction(grids[0], grid, axis)
            if found is None:
                continue
            by_shape, trust = found
            subject = Subject(f"voxel spacing along {'zyx'[axis]} of level {index}", "um")
            stated = Statement(spacing[axis], "its scale")
            choice = settle(subject, [stated, Statement(by_shape, "its shape", trust)])
            notes += choice.notes
            if offset and choice.number == by_shape and grids[0].offset_um and grids[0].spacing_um:
                offset[axis] = grids[0].offset_um[axis] + (by_shape - grids[0].spacing_um[axis]) / 2
            spacing[axis] = choice.number
        settled.append(replace(grid, spacing_um=_triple(spacing), offset_um=_triple(offset)))
    return tuple(settled), tuple(notes)


def _contradiction(finest: Grid, grid: Grid, axis: int) -> tuple[float, Trust] | None:
    """Return the spacing (um) implied by a level's shape, and its trust; None: no contradiction."""
    if finest.spacing_um is None or grid.spacing_um is None:
        return None
    own, coarse = finest.spacing_um[axis], grid.spacing_um[axis]
    if not own > 0 or not coarse > 0:
        return None  # other modules refuse a spacing that is not positive
    fine, count = finest.shape[axis], grid.shape[axis]
    if abs(fine * own / coarse - count) <= _ROUNDING:
        return None
    factor = max(round(fine / count), 1)
    is_whole = abs(fine / factor - count) <= _ROUNDING
    by_shape = own * (factor if is_whole else fine / count)
    return by_shape, Trust.MEASURED if is_whole else Trust.DERIVED


def _triple(values: Sequence[float]) -> Triple | None:
    if not values:
        return None
    z, y, x = values
    return z, y, x
