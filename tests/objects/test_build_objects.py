"""The objects of a tile are closed, as large as their voxels, and fit the neighbouring tile's."""

import numpy as np
import pytest

from stereocell.meshes.validity import find_defects
from stereocell.model.mesh import Mesh
from stereocell.objects.build_objects import BuiltObjects, build_objects
from stereocell.objects.intensities import measure_intensities
from stereocell.objects.options import ObjectOptions
from support.touching_cells import touching_cells

SPACING_UM = (1.0, 0.5, 0.5)
STEP_UM = 2.0**-9


def build(labels: np.ndarray, owned: list[int], start: tuple[int, ...] = (0, 0, 0)) -> BuiltObjects:
    z, y, x = (100 + a * s for a, s in zip(start, SPACING_UM, strict=True))
    return build_objects(
        labels,
        np.array(owned, np.int32),
        spacing_um=SPACING_UM,
        origin_um=(z, y, x),
        step_um=STEP_UM,
        options=ObjectOptions(),
    )


def one_object(mesh: Mesh, number: int) -> Mesh:
    kept = mesh.objects[mesh.triangles[:, 0]] == number
    used, triangles = np.unique(mesh.triangles[kept], return_inverse=True)
    return Mesh(
        mesh.positions[used], triangles.reshape(-1, 3).astype(np.uint32), mesh.normals[used]
    )


@pytest.fixture(scope="module")
def halves() -> tuple[np.ndarray, np.ndarray, list[list[int]], list[BuiltObjects]]:
    """Return cells in two tiles, each with its window: its cells' box and what affects them."""
    labels, centres = touching_cells((36, 56, 160), SPACING_UM)
    left = centres[:, 2] < 40
    owned = [np.flatnonzero(part) + 1 for part in (left, ~left)]
    built = []
    for part in owned:
        at = np.argwhere(np.isin(labels, part))
        low, high = np.maximum(at.min(axis=0) - 42, 0), at.max(axis=0) + 43
        window = labels[tuple(slice(a, b) for a, b in zip(low, high, strict=True))]
        built.append(build(window, part.tolist(), tuple(low.tolist())))
    return labels, centres, [part.tolist() for part in owned], built


@pytest.mark.slow
def test_each_object_is_closed_and_keeps_its_volume(halves) -> None:
    labels, _, owned, built = halves
    for numbers, one in zip(owned, built, strict=True):
        assert len(numbers) > 8
        voxels = np.bincount(labels.ravel())[numbers] * np.prod(SPACING_UM)
        np.testing.assert_allclose(one.volumes_um3, voxels)
        assert max(one.largest_bias[:3]) < 0.01
        triangles = [len(lod.mesh.triangles) for lod in one.lods]
        assert triangles == sorted(triangles, reverse=True)
        for lod in one.lods:
            for place in range(len(numbers)):
                counts = find_defects(one_object(lod.mesh, place)).counts
                assert not any(counts.values()), (place, counts)


@pytest.mark.slow
def test_two_tiles_have_the_same_interface_at_the_finest_level(halves) -> None:
    """Corners are equal bit by bit: each cell is closed, and the two of a pair leave no gap."""
    _, _, owned, built = halves

    def corners(one: BuiltObjects) -> set[tuple[tuple[float, ...], ...]]:
        mesh = one.lods[0].mesh
        found = mesh.positions[mesh.triangles].tolist()
        return {tuple(sorted(map(tuple, triangle))) for triangle in found}

    shared = corners(built[0]) & corners(built[1])
    # the interfaces between the tiles, as measured in each of them
    between = [
        {
            (min(pair), max(pair)): area
            for (place, other), area in zip(one.interfaces.tolist(), one.interface_um2, strict=True)
            for pair in [(numbers[place], other)]
            if other not in numbers
        }
        for numbers, one in zip(owned, built, strict=True)
    ]
    assert len(between[0]) >= 3
    assert between[0].keys() == between[1].keys()
    for pair, area in between[0].items():
        assert area == pytest.approx(between[1][pair], rel=1e-12)
    triangles = np.array([np.array(one) for one in shared])
    sides = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(sides, axis=1).sum() / 2
    assert area == pytest.approx(sum(between[0].values()), rel=1e-4)


@pytest.mark.slow
def test_objects_touch_where_their_voxels_share_faces(halves) -> None:
    labels, _, owned, built = halves
    pairs = set()
    for axis in range(3):
        a = np.delete(labels, -1, axis).ravel()
        b = np.delete(labels, 0, axis).ravel()
        kept = (a != b) & (a > 0) & (b > 0)
        pairs |= set(map(tuple, np.stack([a[kept], b[kept]], 1).tolist()))
    pairs |= {(b, a) for a, b in pairs}
    for numbers, one in zip(owned, built, strict=True):
        found = {(numbers[place], other) for place, other in one.interfaces.tolist()}
        assert found == {(a, b) for a, b in pairs if a in numbers}


def test_a_ball_has_the_area_and_volume_of_a_ball() -> None:
    z, y, x = np.mgrid[:40, :60, :60] * np.array(SPACING_UM)[:, None, None, None]
    ball = ((z - 19) ** 2 + (y - 15) ** 2 + (x - 15) ** 2 < 100).astype(np.int32)
    built = build(ball, [1])
    assert built.areas_um2[0] == pytest.approx(4 * np.pi * 100, rel=0.02)
    assert built.volumes_um3[0] == pytest.approx(4 / 3 * np.pi * 1000, rel=0.01)
    assert built.interfaces.shape == (0, 2)
    x_um, y_um, z_um = one_object(built.lods[0].mesh, 0).positions.mean(axis=0)
    assert (z_um, -y_um, x_um) == pytest.approx((119, 115, 115), abs=0.2)


def test_a_shell_of_one_voxel_is_left_out_and_its_neighbour_is_not() -> None:
    z, y, x = np.mgrid[:30, :30, :40] - np.array([14.5, 14.5, 14.5])[:, None, None, None]
    radius = np.sqrt(z * z + y * y + x * x)
    labels = ((radius < 11) & (radius > 10.3)).astype(np.int32)
    labels[10:20, 10:20, 30:36] = 4
    built = build(labels, [1, 4])
    assert built.thin.tolist() == [1]
    assert built.volumes_um3.tolist() == [10 * 10 * 6 * 0.25]
    assert not any(find_defects(one_object(built.lods[0].mesh, 0)).counts.values())


def test_a_tile_without_objects_of_its_own_has_no_levels() -> None:
    assert build(np.ones((4, 4, 4), np.int32), []).lods == ()


@pytest.mark.parametrize("dtype", ["uint8", "int16", "float32"])
def test_intensities_equal_those_of_numpy(dtype: str) -> None:
    rng = np.random.default_rng(4)
    labels = rng.integers(0, 9, (6, 20, 20)).astype(np.int32)
    voxels = rng.normal(60, 20, labels.shape).clip(0, 200).astype(dtype)
    numbers = np.array([2, 3, 8], np.int32)
    found = measure_intensities(labels, voxels, numbers)
    for place, number in enumerate(numbers):
        own = voxels[labels == number].astype(np.float64)
        assert found.mean[place] == pytest.approx(own.mean())
        assert found.p95[place] == pytest.approx(np.percentile(own, 95))
