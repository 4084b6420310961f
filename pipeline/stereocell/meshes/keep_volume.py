"""Give each body of a simplified mesh the volume that it had: vertices move along their normals.

Simplification keeps a part of the fine surface's vertices, and flat triangles between the vertices
of a round body lie inside of it: at coarse levels bodies would lose a third of their volume. Here
all vertices of a body move outward by one distance, until its volume is the fine one's, or the
distance is at its bound. Towards a cut the move fades out, so that vertices of the cut stay bit by
bit and no other reaches it. No vertex leaves the tile's box, or the fine mesh's where the caps of
the data's end lie outside of that. Where bodies come to cross each other or themselves, the
vertices there stay, and the others move farther for it, unless these are FEW; if that doesn't help,
the whole body moves half as far, and at last not at all. Where MANY cross, as in noise, of which
walls are nearer than the move is long, these bodies stay at once: tries would cost more than all
the rest of a level.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.half_edges import label_bodies, measure_volumes, sum_gains, sum_normals
from stereocell.meshes.validity import Defects, border, find_defects, find_topology
from stereocell.model.lattice import Plane
from stereocell.model.mesh import Mesh

STEPS = 4  # Newton's; volume is a cubic function of the distance
FADE = 1.25  # moves are whole from this many largest moves from a cut on
CALMED = 3  # tries in which the vertices of defects stay, and more around them with each
HALVINGS = 3  # tries with half the move after that, before a body with defects stays

FEW = 0.02  # share of a body's vertices that may stay without others moving farther for them
MANY = 0.05  # share of a level's vertices in defects of its first try, and their number
COSTLY = 10_000

Points = NDArray[np.float64]
Box = tuple[Points, Points]  # least and largest corner, (x, y, z), um


class FineVolumes:
    """The volumes of a fine mesh's bodies, for levels of which each vertex is one of it.

    box  of the tile; None: vertices may move anywhere
    """

    def __init__(self, mesh: Mesh, box: Box | None = None) -> None:
        self._label, count = label_bodies(
            np.ascontiguousarray(mesh.triangles, np.int32), len(mesh.positions)
        )
        low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
        self._origin = (low.astype(np.float64) + high) / 2
        self._low, self._high = np.full(3, -np.inf), np.full(3, np.inf)
        if box is not None:
            self._low, self._high = np.minimum(low, box[0]), np.maximum(high, box[1])
        self._volume = self._measure(mesh.positions, mesh.triangles, self._label, count)

    def _measure(
        self,
        positions: NDArray[np.floating],
        triangles: NDArray[np.integer],
        label: NDArray[np.int32],
        count: int,
    ) -> Points:
        corners = np.ascontiguousarray(triangles, np.int32)
        return measure_volumes(positions - self._origin, corners, label, count)

    def keep(
        self,
        mesh: Mesh,
        vertices: NDArray[np.int64],
        planes: tuple[Plane, ...],
        *,
        max_move_um: float,
    ) -> tuple[Mesh, Defects]:
        """Return a level with the fine bodies' volumes, and the defects that are left.

        vertices     int64 (n,), the number that each vertex has in the fine mesh
        planes       the cut planes
        max_move_um  largest distance of a move
        """
        triangles = np.ascontiguousarray(mesh.triangles, np.int32)
        topology = find_topology(triangles, len(mesh.positions))
        label, count = topology.bodies
        first = np.unique(label, return_index=True)[1]
        wanted = self._volume[self._label[vertices[first]]]
        start = mesh.positions.astype(np.float64)
        share = _fade(mesh, planes, FADE * max_move_um)
        part = np.ones(count)
        fresh = np.ones(len(triangles), bool)
        at = self._move(start, triangles, (label, count), wanted, share, max_move_um)
        placed: Mesh | None = None
        faulty = np.zeros(0, np.int64)
        for number in range(CALMED + HALVINGS + 2):
            moves = (at - start) * part[label][:, None]
            positions = (start + moves).astype(np.float32)
            # bit by bit: a sum would lose the sign of a zero
            positions = np.where(moves == 0, mesh.positions, positions)
            if placed is not None:
                # pairs that stand where they were found sound need not be looked at again
                other = (positions != placed.positions).any(axis=1)
                other[faulty] = True
                fresh = other[mesh.triangles].any(axis=1)
            placed = replace(mesh, positions=positions)
            defects = find_defects(placed, planes, fresh, topology)
            faulty = defects.vertices(mesh.triangles)
            worst = np.unique(label[faulty])
            worst = worst[part[worst] > 0]
            if not len(worst):
                break
            if number == 0 and len(faulty) > max(MANY * len(start), COSTLY):
                part[worst] = 0.0
            elif number < CALMED:
                share[_grow(faulty, mesh.triangles, len(start), number)] = 0.0
                stay = np.bincount(label[share == 0], minlength=count)
                few = (stay < FEW * np.bincount(label, minlength=count))[label][:, None]
                moved = self._move(start, triangles, (label, count), wanted, share, max_move_um)
                at = np.where(few, np.where(share[:, None] == 0, start, at), moved)
            else:
                part[worst] *= 0.5 if number < CALMED + HALVINGS else 0.0
        assert placed is not None
        return placed, defects

    def _move(
        self,
        start: Points,
        triangles: NDArray[np.int32],
        bodies: tuple[NDArray[np.int32], int],
        wanted: Points,
        share: Points,
        max_move_um: float,
    ) -> Points:
        """Return where vertices go, (n, 3), so that each body gets its volume.

        bodies  of each vertex, and their number
        wanted  volumes
        share   of the move that each vertex makes
        """
        label, count = bodies
        at, moved = start.copy(), np.zeros(count)
        for _ in range(STEPS):
            missing = wanted - self._measure(at, triangles, label, count)
            ways = sum_normals(at, triangles) * share[:, None]
            gain = sum_gains(at, triangles, label, count, ways)
            step = np.divide(missing, gain, out=np.zeros(count), where=gain > 1e-12)
            step = np.clip(moved + step, -max_move_um, max_move_um) - moved
            moved += step
            at = np.clip(at + ways * step[label][:, None], self._low, self._high)
        return at


def _grow(
    chosen: NDArray[np.int64], triangles: NDArray[np.uint32], count: int, rings: int
) -> NDArray[np.bool_]:
    """Return the chosen vertices and `rings` rings of neighbours, bool (count,)."""
    found = np.zeros(count, bool)
    found[chosen] = True
    for _ in range(rings):
        found[triangles[found[triangles].any(axis=1)]] = True
    return found


def _fade(mesh: Mesh, planes: tuple[Plane, ...], reach_um: float) -> Points:
    """Return the share of the move that each vertex makes (n,): 0 in a cut, 1 far from it."""
    share = np.ones(len(mesh.positions))
    for column, value in planes:
        away = np.abs(mesh.positions[:, column].astype(np.float64) - value)
        share = np.minimum(share, away / reach_um)
    share[border(mesh.triangles)] = 0.0
    return share
