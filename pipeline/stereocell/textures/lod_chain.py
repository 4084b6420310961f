"""Make all levels of detail of one unit from its fine surface; validate and measure each of them.

Each level is simplified from the one before, so that its vertices are a part of that level's. Then
they move to places near the fine surface, and bodies get their volumes back
(meshes/keep_volume.py). Bodies between near walls may have no space to grow. These are simplified
less, and at last not at all, as long as the level hardly becomes larger. Rims do not change. Small
bodies are removed as a whole if they would become thinner than the error (meshes/small_bodies.py).
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.half_edges import measure_sharpest
from stereocell.meshes.distance import Nearest, measure_enclosure, measure_spread
from stereocell.meshes.keep_volume import Box, EarlierLevel, FineVolumes, RestoredLevel
from stereocell.meshes.options import LodOptions
from stereocell.meshes.simplify import renumber
from stereocell.meshes.simplify_valid import Simplified, Simplifier
from stereocell.meshes.small_bodies import SmallBodies
from stereocell.meshes.validity import Topology, find_topology
from stereocell.model.lattice import Plane
from stereocell.model.mesh import Lod, Mesh, Quality
from stereocell.model.spacing import Spacing
from stereocell.model.timing import Clock
from stereocell.textures.texture_lod import Texturer

# Shares of the error for bodies that lack volume, one try after another
FINER = (0.5, 0.25, 0.0)
# Largest number of triangles of another try, as a multiple of the first try's. Without it a wide
# membrane that lacks 3 % of its volume would stay as large as the level before.
MAX_HEAVIER = 1.5
# Number of triangles by which another try may always exceed the first, because small levels are
# light
MAX_MORE = 1000

# Function of the finest level that is made, and of the indices of its vertices in the fine surface;
# it returns the object that gives values to levels
GetTexturer = Callable[[Mesh, NDArray[np.int64]], Texturer]


def make_levels(
    fine: Mesh,
    planes: tuple[Plane, ...],
    *,
    spacing_um: Spacing,
    lod: LodOptions,
    clock: Clock,
    box: Box | None = None,
    caps: tuple[Plane, ...] = (),
    get_texturer: GetTexturer | None = None,
    first: int = 0,
) -> tuple[Lod, ...]:
    """Return lod0, lod1, ... of the fine surface, which is open only on the planes.

    fine          positions float32 (n, 3) in um, world space (x, y, z)
    planes        the cut planes
    spacing_um    voxel spacing (z, y, x)
    box           box of the tile, least and largest corner (x, y, z), um; vertices do not leave it
    caps          planes of caps, which stay flat
    get_texturer  None: levels get no values
    first         number of the first level that is made; `fine` is then the level before it

    Meshes are validated before the seams of charts split their vertices, which moves no vertex.

    >>> import trimesh
    >>> ball = trimesh.creation.icosphere(subdivisions=4, radius=10)
    >>> corners, normals = np.float32(ball.vertices), np.float32(ball.vertex_normals)
    >>> mesh = Mesh(corners, np.uint32(ball.faces), normals)
    >>> options, spacing_um = LodOptions(errors=(0.1, 1.0)), (1.0, 1.0, 1.0)
    >>> levels = make_levels(mesh, (), spacing_um=spacing_um, lod=options, clock=Clock())
    >>> len(mesh.triangles), [len(level.mesh.triangles) for level in levels]
    (5120, [796, 70])
    """
    lods: list[Lod] = []
    mesh, number = fine, np.arange(len(fine.positions))  # index of each vertex in the fine mesh
    texturer: Texturer | None = None
    place = np.zeros(0, np.int64)  # index of each fine vertex in the finest level made
    with clock("volume kept"):
        topology: Topology | None = find_topology(fine.triangles, len(fine.positions))
        volumes = FineVolumes(fine, planes, box, topology, caps)
        bodies = SmallBodies(fine, topology)
    of_all: Nearest | None = None  # made after the first simplification, which takes most memory
    to_fine: Nearest | None = None  # without bodies that are removed; None: not made yet
    # The vertex of `mesh` that stands for each fine vertex; -1: none does
    owners = np.arange(len(fine.positions), dtype=np.int32)
    gone = np.zeros(len(fine.positions), bool)
    for level, error in list(enumerate(lod.errors))[first:]:
        length = error * min(spacing_um)
        with clock("simplify"):
            small = bodies.find(length)
            if (small > gone).any():
                gone, to_fine = small, None
                stay = ~gone[number[mesh.triangles[:, 0]]]
                used, own = renumber(mesh.triangles[stay], len(number))
                left = np.full(len(number), -1, np.int32)
                left[used] = np.arange(len(used), dtype=np.int32)
                mesh, number = Mesh(mesh.positions[used], own, mesh.normals[used]), number[used]
                owners = _follow(owners, left)
                topology = None
            topology = topology or find_topology(mesh.triangles, len(mesh.positions))
        simplifier = Simplifier(mesh, planes, topology, caps)
        simplified, kept = _simplify(simplifier, topology, (number, owners), volumes, length, clock)
        # The earlier mesh and topology take much memory, which this frees.
        mesh, topology = simplified.mesh, simplified.topology
        number, shown = number[simplified.vertices], kept.mesh
        owners = _follow(owners, simplified.owners)
        with clock("measure"):
            of_all = of_all or Nearest(fine, lod.samples)
            to_fine = to_fine or (of_all.without(gone) if gone.any() else of_all)
            to_mesh = Nearest(shown, lod.samples, simplified.topology.twins)
            away, back = measure_spread(to_fine, to_mesh), measure_spread(to_mesh, to_fine)
            # A coarser level never states a smaller distance, because viewers rely on the order,
            # and distances have sampling errors.
            distance = max(away.p99, back.p99, lods[-1].distance_um if lods else 0.0)
            quality = Quality(
                away=away,
                back=back,
                samples=lod.samples,
                mended=simplified.simplified_again,
                fallbacks=simplified.fallbacks,
                faults=kept.defects.total,
                angle_deg=sharpest_angle(shown),
                enclosed=measure_enclosure(to_fine, to_mesh),
            )
        made = Lod(shown, distance, quality=quality)
        if get_texturer is not None and len(shown.triangles):
            if texturer is None:
                texturer = get_texturer(mesh, number)
                place = np.zeros(len(fine.positions), np.int64)
                place[number] = np.arange(len(number))
            made = texturer.texture(made, level, place[number])
        lods.append(made)
    return tuple(lods)


def _simplify(
    simplifier: Simplifier,
    topology: Topology,
    ancestry: tuple[NDArray[np.int64], NDArray[np.int32]],
    volumes: FineVolumes,
    error_um: float,
    clock: Clock,
) -> tuple[Simplified, RestoredLevel]:
    """Return a simplified level, and the same level with its volumes.

    simplifier  holds the next finer level, which it simplifies
    topology    topology of the next finer level
    ancestry    index of each vertex of the next finer level in the fine mesh, and the vertex of the
                next finer level that stands for each fine one; -1: none does
    """
    number, owners = ancestry
    with clock("simplify"):
        simplified = simplifier.simplify(error_um)
    count = len(simplified.mesh.triangles)
    most, earlier = max(MAX_HEAVIER * count, count + MAX_MORE), None
    best: tuple[Simplified, RestoredLevel] | None = None
    for finer in (*FINER, None):
        with clock("volume kept"):
            own = number[simplified.vertices]
            kept = volumes.keep(
                simplified.mesh,
                own,
                _follow(owners, simplified.owners),
                max_move_um=error_um,
                topology=simplified.topology,
                earlier=earlier,
            )
        best = simplified, kept
        if finer is None or not kept.lacks.any():
            break
        lacking = np.zeros(topology.bodies[1], bool)
        lacking[topology.bodies[0][simplified.vertices[kept.lacks]]] = True
        with clock("simplify"):
            simplified = simplifier.simplify(finer * error_um, lacking)
        if len(simplified.mesh.triangles) > most:
            break
        earlier = EarlierLevel(kept, own, simplified.changed)
    assert best is not None
    return best


def _follow(owners: NDArray[np.int32], onto: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the vertex that stands for each fine vertex, after vertices became others.

    owners  int32 (n,), the vertex that stood for each fine vertex before; -1: none did
    onto    int32 (k,), the vertex that each of these vertices became; -1: none
    """
    followed = onto[owners]
    followed[owners < 0] = -1
    return followed


def sharpest_angle(mesh: Mesh) -> float:
    """Return the 1st percentile, in degrees, of the triangles' smallest angles."""
    triangles = np.ascontiguousarray(mesh.triangles, np.int32)
    cosines = measure_sharpest(mesh.positions.astype(np.float64), triangles)
    return float(np.percentile(np.degrees(np.arccos(np.clip(cosines, -1, 1))), 1))
