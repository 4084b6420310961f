"""Neighbouring tiles in decoded files meet without a crack at any pair of levels of detail."""

from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.formats.gltf import Material, choose_step, encode_glb
from stereocell.formats.gltf_decode import DecodedMesh, read_glb
from stereocell.isosurface.repair_options import RepairOptions
from stereocell.model.lattice import Lattice
from stereocell.model.lattice_field import LatticeField
from stereocell.model.tiling import Box
from stereocell.model.volume import Volume
from stereocell.planning.settings import Settings
from stereocell.planning.unit_steps import unit_options
from stereocell.steps.unit import UnitInput, build_unit

SPACING = (0.28, 0.14, 0.14)
REGION = Box((0, 0, 0), (24, 48, 72))
CUT = 35
OWN = (Box((0, 0, 0), (24, 48, CUT + 1)), Box((0, 0, CUT), (24, 48, 72)))
HALO = (16, 24, 24)
STEP_M = choose_step(8.0)


@pytest.fixture(scope="module")
def levels(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[DecodedMesh], ...]:
    """The decoded levels of two tiles, whose common plane cuts objects and their bridges."""
    noise = np.random.default_rng(5).normal(size=REGION.shape)
    field = ndimage.gaussian_filter(noise, (1.5, 3, 3))
    field = (1000 * field / field.std()).astype(np.float32)
    settings = Settings()
    settings = replace(settings, surface=settings.surface.resolved(SPACING))
    folder, tiles = tmp_path_factory.mktemp("glb"), []
    for number, own in enumerate(OWN):
        window = own.grown(HALO, REGION)
        given = UnitInput(
            lattice=Lattice(window, own, REGION, SPACING, (0.0, 0.0, 0.0)),
            iso=LatticeField(((12.0,), (24.0,), (36.0,)), np.full((1, 1, 1), 600.0)),
            background=None,
            repair=RepairOptions(0.3, 0.5, 0.5),
            step=(1, 1, 1),
            intensity_window=(-3000.0, 3000.0),
            options=unit_options(settings),
        )
        unit = build_unit(Volume(field[window.slices], SPACING), given)
        drawn = []
        for level, lod in enumerate(unit.lods):
            assert lod.quality is not None
            assert lod.quality.faults == 0
            file = Path(folder) / f"{number}_{level}.glb"
            glb = encode_glb(lod.mesh, STEP_M, material=Material((1, 1, 1)), name="tile", extras={})
            file.write_bytes(glb.data)
            drawn.append(read_glb(file))
        tiles.append(drawn)
    return tuple(tiles)


def _unmatched(*parts: DecodedMesh) -> NDArray[np.float32]:
    """Return the ends of directed edges without an opposite edge after welding, (n, 2, 3)."""
    triangles = np.concatenate([part.positions_m[part.triangles] for part in parts])
    points, numbers = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    corners = numbers.reshape(-1, 3).astype(np.int64)
    edges = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges = edges[
        edges[:, 0] != edges[:, 1]
    ]  # drops edges whose ends fall onto the same lattice point
    count = len(points)
    ahead, behind = edges[:, 0] * count + edges[:, 1], edges[:, 1] * count + edges[:, 0]
    keys, places = np.unique(np.concatenate([ahead, behind]), return_inverse=True)
    sums = np.bincount(places, np.repeat([1.0, -1.0], len(ahead)))
    lone = keys[sums != 0]
    return points[np.stack([lone // count, lone % count], axis=-1)]


@pytest.mark.slow
@pytest.mark.parametrize(("ours", "theirs"), list(product(range(4), repeat=2)))
def test_two_tiles_close_at_any_pair_of_levels(
    levels: tuple[list[DecodedMesh], ...], ours: int, theirs: int
) -> None:
    one, other = levels[0][ours], levels[1][theirs]
    for alone in (one, other):
        ends = _unmatched(alone)
        assert len(ends) > 20  # otherwise the test would show nothing
        assert (ends[..., 0] == ends[0, 0, 0]).all()
    assert len(_unmatched(one, other)) == 0


@pytest.mark.slow
def test_coarser_levels_have_fewer_triangles_and_the_same_rims(
    levels: tuple[list[DecodedMesh], ...],
) -> None:
    for tile in levels:
        counts = [len(level.triangles) for level in tile]
        assert len(counts) == 4
        assert all(coarse < 0.6 * fine for fine, coarse in pairwise(counts))
        rims = {np.unique(_unmatched(level).reshape(-1, 3), axis=0).tobytes() for level in tile}
        assert len(rims) == 1
