"""Simplify interfaces: each object stays closed and valid, and keeps the volume of its voxels.

All interfaces are simplified together (kernels/collapse.py), so that neighbours share every
triangle. If triangles meet away from their corners, the vertices around them are locked, and the
interfaces are simplified again. Then each object gets the volume of its voxels back, by the
smallest possible shift of the vertices.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import spsolve

from stereocell.kernels.collapse import collapse_interfaces
from stereocell.kernels.interface_rings import find_orders
from stereocell.kernels.interfaces import (
    bound_objects,
    couple,
    least_of_objects,
    press,
    slope_volumes,
)
from stereocell.meshes.simplify import OF_DIAGONAL, OF_SIDE, SHARPEST_DEG, STRAY
from stereocell.objects.interfaces import Interfaces, find_faults, measure_volumes, put_on_lattice

_ROUNDS = 12  # largest number of rounds of simplifying, and of moving back
_SEARCHES = 6  # number of first rounds of moving in which the moves are computed again
_NEWTON = 4  # largest number of steps towards the volumes
_CLOSE = 5e-4  # share of a volume that may remain missing


def simplify_interfaces(
    interfaces: Interfaces,
    max_error_um: float,
    volumes_um3: NDArray[np.float64],
    step_um: float,
    *,
    locked: NDArray[np.bool_] | None = None,
) -> tuple[Interfaces, bool]:
    """Return the interfaces with fewer triangles, and whether simplification was completed.

    It is not completed if triangles still meet after the last round. The interfaces are then
    returned as they were given, or without restored volumes.

    interfaces         valid, on the lattice; open where the objects beyond are not included
    max_error_um  largest root of the mean squared distance of a vertex from the planes of the
                  triangles that it represents; less at small objects, by their boxes
    volumes_um3   float64 (objects + 1,), volume that each object should have; NaN: any
    step_um       step of the lattice on which vertices lie
    locked        bool (n,), vertices that stay; None: all are free
    """
    if not len(interfaces.triangles):
        return interfaces, True
    fixed = np.zeros(len(interfaces.positions), bool) if locked is None else locked
    errors = _errors(interfaces, max_error_um, len(volumes_um3))
    centre = (interfaces.positions.min(axis=0) + interfaces.positions.max(axis=0)) / 2
    stays = fixed.copy()
    sharpest = float(np.cos(np.radians(SHARPEST_DEG)))
    orders, made = find_orders(interfaces.triangles, len(stays)), np.zeros((0, 2), np.int32)
    for _ in range(_ROUNDS):
        triangles, is_left, made = collapse_interfaces(
            interfaces.positions - centre,
            interfaces.triangles,
            stays,
            errors,
            STRAY,
            sharpest,
            orders,
            made,
        )
        fewer = Interfaces(interfaces.positions, triangles[is_left], interfaces.sides[is_left])
        # Unchanged triangles do not meet one another, so only changed ones are checked.
        at_fault = find_faults(
            fewer, fresh=(triangles != interfaces.triangles).any(axis=1)[is_left]
        )
        if not len(at_fault):
            fewer, used = _compact(fewer)
            # Twice the bound, because small objects also lost volume to smoothing.
            most_um = 2 * STRAY * max_error_um
            return keep_volumes(fewer, fixed[used], most_um, volumes_um3, step_um)
        around = np.zeros(len(stays), bool)
        around[at_fault] = True
        around[interfaces.triangles[around[interfaces.triangles].any(axis=1)]] = True
        stays |= around
    return interfaces, False


def keep_volumes(
    interfaces: Interfaces,
    fixed: NDArray[np.bool_],
    most_um: float,
    volumes_um3: NDArray[np.float64],
    step_um: float,
) -> tuple[Interfaces, bool]:
    """Return the interfaces with each object's volume restored, as far as none cross.

    The second result is whether that was completed. If not, the interfaces are returned as given.

    fixed        bool (n,), vertices that stay
    most_um      largest move of a vertex, um
    volumes_um3  float64 (objects + 1,), volume that each object should have

    Vertices move along the gradients of the volumes. The sum of squared moves, weighted by the area
    around each vertex, is minimised: a linear system with one unknown for each object.
    """
    fixed = fixed | _at_ends(interfaces)
    positions, past = interfaces.positions, interfaces.positions
    at_fault = np.zeros(0, np.int64)
    for turn in range(_ROUNDS):
        if turn < _SEARCHES:  # newly fixed vertices make the others move farther
            moved = _moved(interfaces, positions, volumes_um3, fixed, most_um)
            positions = put_on_lattice(moved, step_um)
        fresh = (positions != past).any(axis=1)
        fresh[at_fault] = True
        moved_now = fresh[interfaces.triangles].any(axis=1)
        at_fault = find_faults(replace(interfaces, positions=positions), fresh=moved_now)
        if not len(at_fault):
            return replace(interfaces, positions=positions), True
        fixed[at_fault] = True
        past = positions
        positions = np.where(fixed[:, np.newaxis], interfaces.positions, positions)
    return interfaces, False


def _moved(
    interfaces: Interfaces,
    start: NDArray[np.float64],
    volumes_um3: NDArray[np.float64],
    fixed: NDArray[np.bool_],
    most_um: float,
) -> NDArray[np.float64]:
    """Return positions (n, 3), um, at which each object has its volume; crossings are ignored.

    start  positions near those of the interfaces, from which the search begins
    """
    moved = replace(interfaces, positions=start)
    for _ in range(_NEWTON):
        missing = volumes_um3[1:] - measure_volumes(moved, len(volumes_um3) - 1)[1:]
        if not (np.abs(missing) > _CLOSE * volumes_um3[1:]).any():
            break
        shift = moved.positions + _shift(moved, missing, fixed) - interfaces.positions
        length = np.linalg.norm(shift, axis=1)
        # The moves are bounded, because a few free vertices would move anywhere.
        share = np.minimum(1.0, most_um / np.maximum(length, 1e-12))
        moved = replace(moved, positions=interfaces.positions + share[:, np.newaxis] * shift)
    return moved.positions


def _at_ends(interfaces: Interfaces) -> NDArray[np.bool_]:
    """Return which vertices lie at open ends (n,), on an edge of only one triangle."""
    ends = np.concatenate([interfaces.triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    ends.sort(axis=1)
    count = np.int64(len(interfaces.positions))
    edges, times = np.unique(ends[:, 0] * count + ends[:, 1], return_counts=True)
    found = np.zeros(count, bool)
    for end in np.divmod(edges[times == 1], count):
        found[end] = True
    return found


def _shift(
    interfaces: Interfaces, missing_um3: NDArray[np.float64], fixed: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return the move of each vertex (n, 3), um. NaN in `missing_um3` means any volume."""
    asked = np.isfinite(missing_um3)
    row = np.concatenate([[-1], np.where(asked, np.cumsum(asked) - 1, -1)]).astype(np.int32)
    count = int(asked.sum())
    entries, own = slope_volumes(interfaces.positions, interfaces.triangles, interfaces.sides, row)
    light = np.where((own > 0) & ~fixed, 1 / np.maximum(own, 1e-12), 0.0)
    among, pairs, values = couple(*entries, light, count)
    # Keeps the system solvable if nothing is left of an object.
    among += 1e-9 * max(float(among.mean()), 1e-12)
    pulls = sparse.coo_matrix((values, pairs.T), (count, count)).tocsc() + sparse.diags(among)
    pressure = spsolve(pulls.tocsc(), missing_um3[asked])
    return press(*entries, light, np.atleast_1d(pressure))


def _errors(interfaces: Interfaces, max_error_um: float, count: int) -> NDArray[np.float64]:
    """Return the largest error of each vertex (n,), um: that of the smallest object at it."""
    low, high = bound_objects(interfaces.positions, interfaces.triangles, interfaces.sides, count)
    lengths = np.maximum(high - low, 0)
    own = np.minimum(OF_DIAGONAL * np.linalg.norm(lengths, axis=1), OF_SIDE * lengths.min(axis=1))
    own[0] = np.inf
    return least_of_objects(
        interfaces.triangles, interfaces.sides, own, max_error_um, len(interfaces.positions)
    )


def _compact(interfaces: Interfaces) -> tuple[Interfaces, NDArray[np.int32]]:
    """Return the interfaces without unused vertices, and the vertices that are left."""
    used, triangles = np.unique(interfaces.triangles, return_inverse=True)
    kept: NDArray[np.int32] = triangles.reshape(-1, 3).astype(np.int32)
    return Interfaces(interfaces.positions[used], kept, interfaces.sides), used
