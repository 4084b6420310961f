"""Make all levels of detail of one unit from its fine surface; each is validated and measured.

Each level is simplified from the one before, so that its vertices are some of that one's, and then
gets back the volume that this took (meshes/keep_volume.py). Bodies that have no room for it between
near walls are simplified less, at last not at all, as long as the level hardly gets heavier by it.
Rims stay as they are.
Small bodies go as a whole where they would be thinner than the error (meshes/small_bodies.py).
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.half_edges import measure_sharpest
from stereocell.meshes.distance import Nearest, measure_enclosure, measure_spread
from stereocell.meshes.keep_volume import Box, Earlier, FineVolumes, Kept
from stereocell.meshes.options import LodOptions
from stereocell.meshes.simplify import compact
from stereocell.meshes.simplify_valid import Simplified, Simplifier
from stereocell.meshes.small_bodies import SmallBodies
from stereocell.meshes.validity import Topology, find_topology
from stereocell.model.lattice import Plane
from stereocell.model.mesh import Lod, Mesh, Quality
from stereocell.model.spacing import Spacing
from stereocell.model.timing import Clock
from stereocell.textures.texture_lod import Texturer

# shares of the error for bodies that lack volume, one try after another
FINER = (0.5, 0.25, 0.0)
# of the first try's triangles that another may have: a wide membrane that lacks 3 % of its volume
# would stay as heavy as the level before
MAX_HEAVIER = 1.5
# triangles that it may have more in any case: small levels weigh little
MAX_MORE = 1000

# returns what gives values to levels, by the finest level that is made and by the numbers that its
# vertices have in the fine surface
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
    """Return lod0, lod1, ... of the fine surface, which is open on the planes and nowhere else.

    fine          positions float32 (n, 3) in um, world space (x, y, z)
    planes        the cut planes
    spacing_um    of the voxels, (z, y, x)
    box           of the tile, least and largest corner (x, y, z), um, which vertices don't leave
    caps          planes of caps, which stay flat
    get_texturer  None: levels get no values
    first         the first level that is made; `fine` is then the level before it

    Meshes are validated before the seams of charts split their vertices: positions stay the same.
    """
    lods: list[Lod] = []
    mesh, number = fine, np.arange(len(fine.positions))  # of each vertex in the fine mesh
    texturer: Texturer | None = None
    place = np.zeros(0, np.int64)  # of a fine vertex in the finest level that is made
    with clock("volume kept"):
        topology: Topology | None = find_topology(fine.triangles, len(fine.positions))
        volumes = FineVolumes(fine, planes, box, topology, caps)
        bodies = SmallBodies(fine, topology)
    with clock("measure"):
        to_fine = of_all = Nearest(fine, lod.samples)
    gone = np.zeros(len(fine.positions), bool)
    for level, error in list(enumerate(lod.errors))[first:]:
        length = error * min(spacing_um)
        with clock("simplify"):
            small = bodies.find(length)
            if (small > gone).any():
                gone = small
                stay = ~gone[number[mesh.triangles[:, 0]]]
                used = np.unique(mesh.triangles[stay])
                mesh, number = compact(mesh, mesh.triangles[stay]), number[used]
                topology = None
            topology = topology or find_topology(mesh.triangles, len(mesh.positions))
        simplifier = Simplifier(mesh, planes, topology, caps)
        simplified, kept = _simplify(simplifier, topology, number, volumes, length, clock)
        mesh, topology = simplified.mesh, simplified.topology  # the past ones take much memory
        number, shown = number[simplified.vertices], kept.mesh
        with clock("measure"):
            if gone.any():
                to_fine = of_all.without(gone)
            to_mesh = Nearest(shown, lod.samples, simplified.topology.twins)
            away, back = measure_spread(to_fine, to_mesh), measure_spread(to_mesh, to_fine)
            # a coarser level is no more accurate: sampling errors must not break the viewers' order
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
    number: NDArray[np.int64],
    volumes: FineVolumes,
    error_um: float,
    clock: Clock,
) -> tuple[Simplified, Kept]:
    """Return a level simplified, and the same with its volumes.

    simplifier  of the level before
    topology    of that level
    number      of each of its vertices in the fine mesh
    """
    with clock("simplify"):
        simplified = simplifier.simplify(error_um)
    count = len(simplified.mesh.triangles)
    most, earlier = max(MAX_HEAVIER * count, count + MAX_MORE), None
    best: tuple[Simplified, Kept] | None = None
    for finer in (*FINER, None):
        with clock("volume kept"):
            own = number[simplified.vertices]
            kept = volumes.keep(
                simplified.mesh,
                own,
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
        earlier = Earlier(kept, own, simplified.changed)
    assert best is not None
    return best


def sharpest_angle(mesh: Mesh) -> float:
    """Return the 1st percentile, in degrees, of the triangles' smallest angles."""
    triangles = np.ascontiguousarray(mesh.triangles, np.int32)
    cosines = measure_sharpest(mesh.positions.astype(np.float64), triangles)
    return float(np.percentile(np.degrees(np.arccos(np.clip(cosines, -1, 1))), 1))
