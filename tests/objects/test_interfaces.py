"""Interfaces between objects are closed, shared, exact in volume and near the truth, at all levels.

Each object has the volume of its voxels.
"""

from collections.abc import Sequence
from functools import cache
from itertools import pairwise

import h5py
import numpy as np
import pytest
import tifffile
from numpy.typing import NDArray

from corpus.real import data_folder
from stereocell.meshes.validity import find_defects, label_components
from stereocell.model.volume import zyx_to_xyz
from stereocell.objects import simplify_interfaces as simplifying
from stereocell.objects.interfaces import (
    Interfaces,
    extract_interfaces,
    find_faults,
    measure_volumes,
    surfaces_of,
)
from stereocell.objects.simplify_interfaces import keep_volumes, simplify_interfaces
from stereocell.objects.well_composed import make_well_composed
from support.exhaustive import sweep
from support.touching_cells import RADIUS_UM, touching_cells

SPACING_UM = (1.0, 0.5, 0.5)
STEP_UM = 1 / 256
AIMS_UM = (0.1, 0.2, 0.4, 0.8)


def levels_of(
    labels: NDArray[np.int32], spacing_um: tuple[float, float, float], aims_um: Sequence[float]
) -> tuple[list[Interfaces], NDArray[np.float64]]:
    mended, _, _ = make_well_composed(np.pad(labels, 2))
    volumes = np.bincount(mended.ravel()) * np.prod(spacing_um)
    found = [extract_interfaces(mended, spacing_um, STEP_UM)]
    for aim in aims_um:
        interfaces, is_done = simplify_interfaces(found[-1], aim, volumes, STEP_UM)
        assert is_done
        found.append(interfaces)
    return found, volumes


@cache
def tissue() -> tuple[list[Interfaces], NDArray[np.float64], NDArray[np.float64]]:
    labels, centres = touching_cells((36, 72, 72), SPACING_UM)
    levels, volumes = levels_of(labels, SPACING_UM, AIMS_UM)
    return levels, volumes, centres


def require_valid(interfaces: Interfaces, objects: int) -> None:
    for number in range(1, objects + 1):
        counts = find_defects(surfaces_of(interfaces, np.array([number], np.int32))).counts
        assert not any(counts.values()), (number, counts)


@pytest.mark.slow
def test_each_object_is_closed_and_valid_at_each_level() -> None:
    levels, _, centres = tissue()
    assert len(centres) >= 12
    for interfaces in levels:
        require_valid(interfaces, len(centres))
        assert not len(find_faults(interfaces))  # no interface meets another elsewhere
    triangles = [len(interfaces.triangles) for interfaces in levels]
    assert all(fewer < 0.75 * many for many, fewer in pairwise(triangles)), triangles


@pytest.mark.slow
def test_neighbours_share_their_interface_triangle_by_triangle() -> None:
    levels, _, centres = tissue()
    for interfaces in levels:
        assert (interfaces.sides[:, 0] < interfaces.sides[:, 1]).all()
        shared = interfaces.sides[(interfaces.sides > 0).all(axis=1)]
        assert len(np.unique(shared, axis=0)) >= len(centres)  # the cells do touch
        # All objects together are as large as the hole in their surroundings, so there are no gaps.
        around = interfaces.sides[:, 0] == 0
        corners = interfaces.positions[interfaces.triangles[around]]
        whole = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum()
        assert measure_volumes(interfaces, len(centres)).sum() == pytest.approx(
            -whole / 6, rel=1e-9
        )


def test_each_object_keeps_the_volume_of_its_voxels() -> None:
    levels, volumes, centres = tissue()
    # The coarsest level has facets as large as a quarter of a cell.
    for interfaces, median, most in zip(
        levels[1:], (1e-3,) * 3 + (5e-3,), (0.01,) * 3 + (0.03,), strict=True
    ):
        bias = measure_volumes(interfaces, len(centres))[1:] / volumes[1:] - 1
        assert abs(np.median(bias)) < median
        assert np.abs(bias).max() < most


def test_interfaces_lie_near_the_true_ones() -> None:
    """Interfaces of two cells lie midway between their centres, and others on the cell's sphere."""
    levels, _, centres = tissue()
    for interfaces, most_um in zip(levels[1:], (0.16, 0.17, 0.2, 0.3), strict=True):
        corners = interfaces.positions[interfaces.triangles]
        x, y, z = corners.mean(axis=1).T
        at = np.stack([z, -y, x], axis=1) - 2 * np.array(SPACING_UM)  # two voxels are padding
        area = np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        )
        first, second = interfaces.sides.T
        to_second = np.linalg.norm(at - centres[second - 1], axis=1)
        to_first = np.linalg.norm(at - centres[first - 1], axis=1)
        between = np.linalg.norm(centres[second - 1] - centres[first - 1], axis=1)
        planes = (to_first**2 - to_second**2) / (2 * np.maximum(between, 1e-9))
        distance = np.abs(np.where(first > 0, planes, to_second - RADIUS_UM))
        assert np.average(distance, weights=area) < most_um


@pytest.mark.parametrize(
    ("spacing_um", "most_deg"), [((0.5, 0.5, 0.5), 6.0), ((1.0, 0.5, 0.5), 10.0)]
)
def test_a_ball_is_round_where_its_slices_end(
    spacing_um: tuple[float, float, float], most_deg: float
) -> None:
    radius_um, middle = 8.0, np.array([0.13, -0.21, 0.17])  # (z, y, x), off the voxels' centres
    axes = [(np.arange(n) - n // 2) * s for n, s in zip((44, 44, 44), spacing_um, strict=True)]
    grid = np.meshgrid(*(axis - at for axis, at in zip(axes, middle, strict=True)), indexing="ij")
    inside = (np.linalg.norm(grid, axis=0) < radius_um).astype(np.int32)
    origin_um = tuple(float(axis[0]) for axis in axes)
    interfaces = extract_interfaces(inside, spacing_um, STEP_UM, origin_um=origin_um)
    at = interfaces.positions - zyx_to_xyz(middle)
    assert np.abs(np.linalg.norm(at, axis=1) - radius_um).mean() < 0.1 * max(spacing_um)
    corners = at[interfaces.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    outward = corners.mean(axis=1)
    cosine = (normals * outward).sum(axis=1) / areas / np.linalg.norm(outward, axis=1)
    off_deg = np.degrees(np.arccos(np.clip(np.abs(cosine), 0, 1)))
    order = np.argsort(off_deg)
    share = np.cumsum(areas[order]) / areas.sum()
    assert off_deg[order][np.searchsorted(share, 0.95)] < most_deg


def test_vertices_lie_on_the_lattice() -> None:
    for interfaces in tissue()[0]:
        np.testing.assert_array_equal(
            interfaces.positions, np.round(interfaces.positions * 256) / 256
        )


def test_simplifying_keeps_a_ring_and_two_pieces() -> None:
    z, y, x = np.mgrid[:16, :40, :40] - np.array([7.5, 19.5, 19.5])[:, None, None, None]
    ring = (np.hypot(np.hypot(y, x) - 12, z) < 4.5).astype(np.int32)
    ring[np.hypot(np.hypot(z, y), x) < 5] = 2
    ring[6:10, 2:5, 2:5] = 2  # one object in two pieces
    levels, _ = levels_of(ring, (1.0, 1.0, 1.0), (0.2, 0.4, 0.8))
    for interfaces in levels:
        require_valid(interfaces, 2)
        for number, bodies, genus in ((1, 1, 1), (2, 2, 0)):
            mesh = surfaces_of(interfaces, np.array([number], np.int32))
            vertices, faces = len(mesh.positions), len(mesh.triangles)
            assert label_components(mesh.triangles, vertices).max() + 1 == bodies
            assert vertices - faces // 2 == 2 * bodies - 2 * genus  # Euler


def test_an_object_that_fills_the_volume_is_a_box() -> None:
    levels, volumes = levels_of(np.ones((8, 10, 12), np.int32), (2.0, 1.0, 1.0), (0.2, 0.8))
    for interfaces in levels:
        require_valid(interfaces, 1)
    assert volumes[1] == pytest.approx(2 * 8 * 10 * 12)
    assert measure_volumes(levels[-1], 1)[1] == pytest.approx(volumes[1], rel=1e-3)


def test_labels_without_an_object_have_no_interfaces() -> None:
    levels, _ = levels_of(np.zeros((4, 5, 6), np.int32), SPACING_UM, AIMS_UM)
    assert all(
        interfaces.triangles.shape == interfaces.positions.shape == (0, 3) for interfaces in levels
    )


@pytest.mark.slow
def test_small_objects_stay_at_all_levels() -> None:
    labels = np.zeros((6, 6, 40), np.int32)
    for number in range(1, 10):
        labels[2 : 2 + number % 3 + 1, 2:4, 4 * number - 1 : 4 * number + 1] = number
    levels, volumes = levels_of(labels, (1.0, 1.0, 1.0), AIMS_UM)
    for interfaces in levels:
        require_valid(interfaces, 9)
    np.testing.assert_allclose(measure_volumes(levels[-1], 9)[1:], volumes[1:], rtol=0.02)


@pytest.mark.slow
def test_the_same_labels_give_the_same_interfaces() -> None:
    labels, _ = touching_cells((36, 72, 72), SPACING_UM)
    again, _ = levels_of(labels, SPACING_UM, AIMS_UM)
    for a, b in zip(tissue()[0], again, strict=True):
        assert a.positions.tobytes() == b.positions.tobytes()
        assert a.triangles.tobytes() == b.triangles.tobytes()


def _mask(name: str) -> NDArray[np.integer]:
    folder = data_folder()
    assert folder is not None
    if name == "nuclei":
        return tifffile.imread(folder / "nuclei_stardist" / "mask3d.tif")
    with h5py.File(folder / "ovule_plantseg" / "sample_ovule.h5") as file:
        return file["label"][:]


@pytest.mark.slow
@pytest.mark.skipif(data_folder() is None, reason="STEREOCELL_DATA is not set")
@pytest.mark.parametrize("name", sweep(["ovule", "nuclei"], kept=["nuclei"]))
def test_masks_of_real_cells_keep_their_volumes(name: str) -> None:
    mask = _mask(name)
    ids, numbered = np.unique(mask, return_inverse=True)
    labels = (numbered.reshape(mask.shape) + (ids[0] != 0)).astype(np.int32)
    levels, volumes = levels_of(labels, (1.0, 1.0, 1.0), (0.15, 0.3, 0.6))
    objects = len(volumes) - 1
    assert objects >= 50
    for interfaces in levels:
        require_valid(interfaces, objects)
    for interfaces in levels[1:]:
        bias = measure_volumes(interfaces, objects)[1:] / volumes[1:] - 1
        assert abs(np.median(bias)) < 1e-3
        assert np.abs(np.percentile(bias, [2, 98])).max() < 0.01


def test_a_few_free_vertices_do_not_move_far() -> None:
    """However coarse the aim: most of the vertices of so few triangles can't move at all."""
    levels, volumes, _ = tissue()
    coarse = levels[-1]
    low, high = coarse.positions.min(axis=0), coarse.positions.max(axis=0)
    aim_um = 2.0
    coarser, _ = simplify_interfaces(coarse, aim_um, volumes, STEP_UM)
    assert (coarser.positions > low - 3 * aim_um).all()
    assert (coarser.positions < high + 3 * aim_um).all()
    keeps, _ = keep_volumes(
        coarse, np.arange(len(coarse.positions)) % 9 > 0, aim_um, 3 * volumes, STEP_UM
    )
    assert np.abs(keeps.positions - coarse.positions).max() <= aim_um + STEP_UM


def test_interfaces_that_still_cross_after_all_rounds_are_returned_unchanged_and_reported(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    levels, volumes, _ = tissue()
    interfaces = levels[1]
    monkeypatch.setattr(
        simplifying, "find_faults", lambda interfaces, fresh: interfaces.triangles[0]
    )
    left, is_done = simplify_interfaces(interfaces, AIMS_UM[1], volumes, STEP_UM)
    assert (left is interfaces, is_done) == (True, False)
    free = np.zeros(len(interfaces.positions), bool)
    left, is_done = keep_volumes(interfaces, free, 1.0, volumes, STEP_UM)
    assert (left is interfaces, is_done) == (True, False)
