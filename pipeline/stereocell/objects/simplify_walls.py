"""Fewer triangles for walls: each object stays closed, valid and as large as its voxels.

All walls are simplified at once (kernels/collapse.py), so that neighbours share every
triangle. Where triangles come to meet beside their corners, the vertices around stay as they are,
and it is done again. Then each object gets its voxels' volume back, by the least shift of the
vertices.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import spsolve

from stereocell.kernels.collapse import collapse_interfaces
from stereocell.kernels.interface_rings import find_orders
from stereocell.kernels.walls import (
    bound_objects,
    couple,
    least_of_objects,
    press,
    slope_volumes,
)
from stereocell.meshes.simplify import OF_DIAGONAL, OF_SIDE, SHARPEST_DEG, STRAY
from stereocell.objects.walls import Walls, find_faults, measure_volumes, put_on_lattice

_ROUNDS = 12  # rounds of simplifying, and rounds of moving back
_SEARCHES = 6  # first rounds of moving, in which the moves are found again
_NEWTON = 4  # steps towards the volumes, at most
_CLOSE = 5e-4  # share of a volume that may be missing


def simplify_walls(
    walls: Walls,
    max_error_um: float,
    volumes_um3: NDArray[np.float64],
    step_um: float,
    *,
    locked: NDArray[np.bool_] | None = None,
) -> tuple[Walls, bool]:
    """Return the walls with fewer triangles, and whether that came to an end.

    It doesn't where triangles still meet after as many rounds as there are: then the walls are as
    they were, or their objects' volumes not made up for.

    walls         valid, on the lattice; open where the objects beyond are not looked at
    max_error_um  largest root of the mean squared distance of a vertex from the planes of the
                  triangles that it stands for; at small objects less, by their boxes
    volumes_um3   float64 (objects + 1,), what each object should hold; NaN: it is not looked at
    step_um       of the lattice
    locked        bool (n,), the vertices that stay where they are; None: none
    """
    if not len(walls.triangles):
        return walls, True
    fixed = np.zeros(len(walls.positions), bool) if locked is None else locked
    errors = _errors(walls, max_error_um, len(volumes_um3))
    centre = (walls.positions.min(axis=0) + walls.positions.max(axis=0)) / 2
    stays = fixed.copy()
    sharpest = float(np.cos(np.radians(SHARPEST_DEG)))
    orders, made = find_orders(walls.triangles, len(stays)), np.zeros((0, 2), np.int32)
    for _ in range(_ROUNDS):
        triangles, is_left, made = collapse_interfaces(
            walls.positions - centre,
            walls.triangles,
            stays,
            errors,
            STRAY,
            sharpest,
            orders,
            made,
        )
        fewer = Walls(walls.positions, triangles[is_left], walls.sides[is_left])
        # triangles that are as they were don't meet one another
        at_fault = find_faults(fewer, fresh=(triangles != walls.triangles).any(axis=1)[is_left])
        if not len(at_fault):
            fewer, used = _compact(fewer)
            # twice: what smoothing took of objects of a few voxels comes back, too
            most_um = 2 * STRAY * max_error_um
            return keep_volumes(fewer, fixed[used], most_um, volumes_um3, step_um)
        around = np.zeros(len(stays), bool)
        around[at_fault] = True
        around[walls.triangles[around[walls.triangles].any(axis=1)]] = True
        stays |= around
    return walls, False


def keep_volumes(
    walls: Walls,
    fixed: NDArray[np.bool_],
    most_um: float,
    volumes_um3: NDArray[np.float64],
    step_um: float,
) -> tuple[Walls, bool]:
    """Return the walls with each object as large as it should be, as far as nothing comes to cross.

    And whether that came to an end; if not, they are as they were.

    fixed        bool (n,), vertices that stay
    most_um      how far a vertex may move
    volumes_um3  float64 (objects + 1,), the volume that each object should have

    Moved is along the volumes' gradients, the least by the areas of the vertices' surroundings: a
    linear system of one unknown an object.
    """
    fixed = fixed | _at_ends(walls)
    positions, past = walls.positions, walls.positions
    at_fault = np.zeros(0, np.int64)
    for turn in range(_ROUNDS):
        if turn < _SEARCHES:  # what can't move makes the others move more
            moved = _moved(walls, positions, volumes_um3, fixed, most_um)
            positions = put_on_lattice(moved, step_um)
        fresh = (positions != past).any(axis=1)
        fresh[at_fault] = True
        moved_now = fresh[walls.triangles].any(axis=1)
        at_fault = find_faults(replace(walls, positions=positions), fresh=moved_now)
        if not len(at_fault):
            return replace(walls, positions=positions), True
        fixed[at_fault] = True
        past = positions
        positions = np.where(fixed[:, np.newaxis], walls.positions, positions)
    return walls, False


def _moved(
    walls: Walls,
    start: NDArray[np.float64],
    volumes_um3: NDArray[np.float64],
    fixed: NDArray[np.bool_],
    most_um: float,
) -> NDArray[np.float64]:
    """Return where the vertices are when each object has its volume (n, 3), um, if they may go.

    start  where they are, not far from the walls
    """
    moved = replace(walls, positions=start)
    for _ in range(_NEWTON):
        missing = volumes_um3[1:] - measure_volumes(moved, len(volumes_um3) - 1)[1:]
        if not (np.abs(missing) > _CLOSE * volumes_um3[1:]).any():
            break
        shift = moved.positions + _shift(moved, missing, fixed) - walls.positions
        length = np.linalg.norm(shift, axis=1)
        # few vertices that may move would go anywhere
        share = np.minimum(1.0, most_um / np.maximum(length, 1e-12))
        moved = replace(moved, positions=walls.positions + share[:, np.newaxis] * shift)
    return moved.positions


def _at_ends(walls: Walls) -> NDArray[np.bool_]:
    """Return which vertices lie at open ends (n,): of an edge of one triangle alone."""
    ends = np.concatenate([walls.triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    ends.sort(axis=1)
    count = np.int64(len(walls.positions))
    edges, times = np.unique(ends[:, 0] * count + ends[:, 1], return_counts=True)
    found = np.zeros(count, bool)
    for end in np.divmod(edges[times == 1], count):
        found[end] = True
    return found


def _shift(
    walls: Walls, missing_um3: NDArray[np.float64], fixed: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return how far each vertex moves (n, 3), um; `missing_um3` is NaN where nothing is asked."""
    asked = np.isfinite(missing_um3)
    row = np.concatenate([[-1], np.where(asked, np.cumsum(asked) - 1, -1)]).astype(np.int32)
    count = int(asked.sum())
    entries, own = slope_volumes(walls.positions, walls.triangles, walls.sides, row)
    light = np.where((own > 0) & ~fixed, 1 / np.maximum(own, 1e-12), 0.0)
    among, pairs, values = couple(*entries, light, count)
    # an object of which nothing is left pulls nothing
    among += 1e-9 * max(float(among.mean()), 1e-12)
    pulls = sparse.coo_matrix((values, pairs.T), (count, count)).tocsc() + sparse.diags(among)
    pressure = spsolve(pulls.tocsc(), missing_um3[asked])
    return press(*entries, light, np.atleast_1d(pressure))


def _errors(walls: Walls, max_error_um: float, count: int) -> NDArray[np.float64]:
    """Return the error that each vertex may have (n,), um: that of the smallest object there."""
    low, high = bound_objects(walls.positions, walls.triangles, walls.sides, count)
    lengths = np.maximum(high - low, 0)
    own = np.minimum(OF_DIAGONAL * np.linalg.norm(lengths, axis=1), OF_SIDE * lengths.min(axis=1))
    own[0] = np.inf
    return least_of_objects(walls.triangles, walls.sides, own, max_error_um, len(walls.positions))


def _compact(walls: Walls) -> tuple[Walls, NDArray[np.int32]]:
    """Return the walls without vertices of none, and which vertices are left."""
    used, triangles = np.unique(walls.triangles, return_inverse=True)
    kept: NDArray[np.int32] = triangles.reshape(-1, 3).astype(np.int32)
    return Walls(walls.positions[used], kept, walls.sides), used
