"""Neighbouring tiles agree on the plane and the voxels that they share.

The scene (`phantoms.seam_scene`) has on every face between two tiles what could make them disagree:
a change of brightness, to which each tile's own level follows, and fragments, gaps and cavities of
which a window without a halo would see only a part.
"""

from dataclasses import dataclass
from itertools import combinations, product
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.building.out_folder import OutFolder
from stereocell.cli.__main__ import main
from stereocell.isosurface.channel_level import ChannelLevels
from stereocell.isosurface.extract import extract_surface
from stereocell.isosurface.level import Level
from stereocell.isosurface.level_evidence import TileEvidence
from stereocell.meshes.validity import find_defects
from stereocell.model.lattice import Lattice
from stereocell.model.mesh import Lod, Mesh
from stereocell.model.tiling import Box, Tile, cut
from stereocell.planning.plan import Plan
from stereocell.steps.unit_files import load_lods, load_record, load_volume
from support import phantoms
from support.meshes import welded

TILE = phantoms.SEAM_TILE
LODS = 4
SETTINGS = """
[isovalue]
scope = "tile"
[surface]
smoothing_um = 0.5
# The gaps are so wide that alpha closes them only once the Gaussian has narrowed them.
max_shift = 0.0
alpha_um = 3.0
min_diagonal_um = 10.0
max_cavity_um = 12.0
[unwrap]
first_lod = 9
"""


@dataclass(frozen=True)
class Built:
    plan: Plan
    iso_values: dict[str, float]
    lods: dict[str, tuple[Lod, ...]]
    volumes: dict[str, NDArray[np.uint8]]
    repaired: dict[str, tuple[int, int]]  # fragments, cavities
    window: tuple[float, float]


@dataclass(frozen=True)
class Seam:
    """Two tiles that share a face, the later one second."""

    first: Tile
    second: Tile
    axis: int
    plane: int

    def rim(self, lod: Lod, plan: Plan) -> dict[bytes, NDArray[np.float32]]:
        """Return the normals of the vertices on the common plane, by float32 position."""
        column, sign = ((2, 1), (1, -1), (0, 1))[self.axis]
        at = np.float32(sign * self.plane * plan.spacing_um[self.axis])
        on_plane = lod.mesh.positions[:, column] == at
        return {
            position.tobytes(): normal
            for position, normal in zip(
                lod.mesh.positions[on_plane], lod.mesh.normals[on_plane], strict=True
            )
        }


@pytest.fixture(scope="module")
def scene() -> NDArray[np.uint16]:
    return phantoms.seam_scene()


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory, scene: NDArray[np.uint16]) -> Built:
    return _build(tmp_path_factory.mktemp("seams"), scene, SETTINGS)


def _build(folder: Path, scene: NDArray[np.uint16], settings: str) -> Built:
    source, out = folder / "scene.ome.tif", folder / "out"
    phantoms.write_ome_tiff(source, scene, spacing=(1.0, 1.0, 1.0), names=["cells"])
    (folder / "settings.toml").write_text(settings)
    flags = ["--tile-size", f"{TILE},{TILE},{TILE}", "--config", str(folder / "settings.toml")]
    assert main(["plan", str(source), "-o", str(out), *flags]) == 0
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ChannelLevels, "level_of_tile", _a_quarter_up)
        assert main(["units", str(out), "--workers", "0"]) == 0
    out_folder = OutFolder(out)
    plan, index, survey = out_folder.plan(), out_folder.index(), out_folder.survey()["cells"]
    folders = {
        t.id: out_folder.unit_dir(f"{t.id}/cells", index[f"{t.id}/cells"]) for t in plan.tiles
    }
    records = {tile: load_record(unit) for tile, unit in folders.items()}
    return Built(
        plan,
        {tile: found["value"] for tile, found in survey["iso"].items()},
        {tile: load_lods(unit) for tile, unit in folders.items()},
        {tile: np.array(load_volume(unit)) for tile, unit in folders.items()},
        {t: (r["fragments_dropped"], r["cavities_filled"]) for t, r in records.items()},
        tuple(survey["statistics"]["window"]),
    )


def _a_quarter_up(levels: ChannelLevels, level: Level, tile: TileEvidence) -> float:
    """Return a tile's own level, however much it differs from the channel's."""
    counts = np.cumsum(tile.plain.counts + tile.padding.counts)
    places = np.searchsorted(counts, [0.5 * counts[-1], 0.99 * counts[-1]])
    low, high = levels.histogram.centres[places]
    return float(low + (high - low) / 4)


def _seams(plan: Plan) -> list[Seam]:
    seams = []
    for a, b in combinations(plan.tiles, 2):
        apart = [axis for axis in range(3) if a.box.start[axis] != b.box.start[axis]]
        if len(apart) == 1:
            first, second = sorted((a, b), key=lambda tile: tile.box.start)
            seams.append(Seam(first, second, apart[0], second.box.start[apart[0]]))
    return seams


def _chessboard(built: Built, even: int, odd: int) -> Mesh:
    """Return one mesh of all tiles, alternately at one level and at the other."""
    meshes = [
        built.lods[tile.id][(even, odd)[sum(start // TILE for start in tile.box.start) % 2]].mesh
        for tile in built.plan.tiles
    ]
    whole = welded(meshes)
    assert len(whole.triangles) == sum(len(mesh.triangles) for mesh in meshes)
    return whole


def _assert_same_rims(built: Built, level: int) -> None:
    for seam in _seams(built.plan):
        ours, theirs = (built.lods[tile.id] for tile in (seam.first, seam.second))
        rim = seam.rim(ours[level], built.plan)
        # each face is crossed by structures of at least 18 voxels
        places = np.array([np.frombuffer(place, np.float32) for place in rim])
        assert len(rim) > 20, seam
        assert np.sort(np.ptp(places, axis=0))[1] > 16, seam
        assert set(rim) == set(seam.rim(theirs[level], built.plan)), seam
        # at all other levels, too, because viewers show neighbours at different ones
        assert set(rim) == set(seam.rim(theirs[0], built.plan)), seam


@pytest.mark.slow
def test_the_scene_would_reveal_disagreeing_neighbours(built: Built) -> None:
    """Otherwise the tests below would show nothing."""
    seams = _seams(built.plan)
    assert len(seams) == 12
    # a unit does not read all of its neighbour, only the halo
    assert max(built.plan.halo) + 1 < TILE
    for seam in seams:
        dim, bright = sorted(built.iso_values[tile.id] for tile in (seam.first, seam.second))
        assert bright > 1.2 * dim
    for dropped, filled in built.repaired.values():
        assert dropped > 0
        assert filled > 0


@pytest.mark.slow
@pytest.mark.parametrize("level", range(LODS))
def test_neighbours_have_the_same_vertices_on_their_common_plane(built: Built, level: int) -> None:
    _assert_same_rims(built, level)


@pytest.mark.parametrize(("even", "odd"), list(product(range(LODS), repeat=2)))
def test_tiles_make_one_valid_surface_at_any_two_levels(built: Built, even: int, odd: int) -> None:
    """Tiles alternate between two levels like the squares of a chessboard.

    Nothing is left open, and nothing crosses or doubles: no crack, and no wall in the planes.
    """
    whole = _chessboard(built, even, odd)
    assert not find_defects(whole).total, find_defects(whole).counts


@pytest.mark.slow
def test_tiles_make_one_valid_surface_on_thinned_planes(
    tmp_path: Path, scene: NDArray[np.uint16]
) -> None:
    """Every third plane carries the surface; three divides no tile."""
    built = _build(
        tmp_path, scene, SETTINGS.replace("[surface]", "[surface]\ngrid_um = 3.0\nmax_thin = 1.0")
    )
    assert TILE % 3
    assert built.plan.step == (3, 3, 3)
    meshes = [lods[0].mesh for lods in built.lods.values()]
    whole = welded(meshes)
    assert len(np.unique(whole.triangles)) < sum(len(mesh.positions) for mesh in meshes)
    assert not find_defects(whole).total, find_defects(whole).counts


@pytest.mark.parametrize("level", range(LODS))
def test_neighbours_have_the_same_normals_on_their_common_plane(built: Built, level: int) -> None:
    for seam in _seams(built.plan):
        ours, theirs = (
            seam.rim(built.lods[tile.id][level], built.plan) for tile in (seam.first, seam.second)
        )
        for position, normal in ours.items():
            np.testing.assert_allclose(normal, theirs[position], atol=1e-5)


def test_no_fragments_gaps_and_cavities_are_left(built: Built) -> None:
    """On a common plane, each face shows one outline: that of its ball or of its slabs."""
    for seam in _seams(built.plan):
        rim = seam.rim(built.lods[seam.first.id][0], built.plan)
        zyx = np.array([np.frombuffer(p, np.float32)[[2, 1, 0]] for p in rim]) * [1, -1, 1]
        across = np.delete(zyx, seam.axis, axis=1)
        across = np.minimum(across, 2 * TILE - 1 - across)  # mirrored into the first quadrant
        at_bodies = across[(across < TILE - 8).all(axis=1)]  # without the ball in the middle
        ways = np.arctan2(*(at_bodies - 13).T) / (2 * np.pi) + 0.5
        assert len(np.unique((8 * ways).astype(int) % 8)) == 8  # the outline covers all directions
        assert np.abs(at_bodies - 13).max() < 13  # no fragment
        assert (
            np.abs(at_bodies - 13).max(axis=1).min() > 6
        )  # no cavity and no gap, because the outline is complete


def test_the_apron_holds_the_neighbours_own_voxels(built: Built, scene: NDArray[np.uint16]) -> None:
    plan = built.plan
    own = np.zeros(scene.shape, np.uint8)
    for tile in plan.tiles:
        z, y, x = tile.box.shape
        own[tile.box.slices] = built.volumes[tile.id][1 : z + 1, 1 : y + 1, 1 : x + 1]
    low, high = built.window
    expected = np.clip((scene.astype(np.float64) - low) / (high - low), 0, 1) * 255
    assert np.abs(own - expected).max() < 0.51
    padded = np.pad(own, 1, mode="edge")
    for tile in plan.tiles:
        lattice = tile.lattice(plan.region)
        part = tuple(slice(a, b + 2) for a, b in zip(lattice.start, lattice.stop, strict=True))
        np.testing.assert_array_equal(built.volumes[tile.id], padded[part])
    # the apron is another plane and not a copy of the tile's own
    for seam in _seams(plan):
        ours = np.moveaxis(built.volumes[seam.first.id], seam.axis, 0)
        theirs = np.moveaxis(built.volumes[seam.second.id], seam.axis, 0)
        assert (ours[-1] != ours[-2]).mean() > 0.2
        assert (theirs[0] != theirs[1]).mean() > 0.2


def test_lattice_points_on_the_iso_value_make_no_degenerate_triangle() -> None:
    """Distances are whole numbers, so every second crossing falls on a lattice point."""
    region = Box((0, 0, 0), (13, 13, 25))
    z, y, x = np.indices(region.shape)
    distance = np.clip(5 - abs(z - 6) - abs(y - 6) - abs(x - 12), -2, 2).astype(np.float32)
    assert (distance == 0).sum() > 50
    rims = []
    for tile in cut(region, (13, 13, 12)):
        lattice = tile.lattice(region)
        part = distance[lattice.slices]
        mesh = extract_surface(
            part, Lattice(lattice, lattice, region, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0))
        )
        a, b, c = (mesh.positions[mesh.triangles[:, k]].astype(np.float64) for k in range(3))
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
        assert area.min() > 1e-5
        assert len(np.unique(mesh.positions, axis=0)) == len(mesh.positions)
        on_plane = mesh.positions[:, 0] == 12
        rims.append({position.tobytes() for position in mesh.positions[on_plane]})
    assert len(rims[0]) > 10
    assert rims[0] == rims[1]
