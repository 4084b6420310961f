"""Half-edges: twins, fans and components, compared with counts by hand or by array expressions."""

import numpy as np
import pytest

from stereocell.kernels.half_edges import (
    BORDER,
    CROWDED,
    count_fans,
    find_first,
    label_vertices,
    lie_within,
    match_twins,
    measure_areas,
    measure_boxes,
    measure_volumes,
    measure_windings,
    renumber_corners,
    sum_gains,
    sum_normals,
)
from stereocell.kernels.triangles import doubled_area
from support.meshes import SOUND, ball, enclosed_volume, joined, moved

TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], np.int32)


@pytest.mark.parametrize("name", [name for name in SOUND if name != "nothing"])
def test_twins_run_along_the_same_edge_in_opposite_directions(name: str) -> None:
    mesh = SOUND[name]
    triangles = mesh.triangles.astype(np.int32)
    twins = match_twins(triangles, len(mesh.positions))
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    assert (twins >= 0).all()
    np.testing.assert_array_equal(start[twins], end)
    np.testing.assert_array_equal(twins[twins], np.arange(len(twins)))
    _, valence = count_fans(triangles, twins, len(mesh.positions))
    np.testing.assert_array_equal(valence, np.bincount(start, minlength=len(mesh.positions)))


def test_borders_and_crowded_edges_have_no_twins() -> None:
    assert (
        sorted(match_twins(TETRAHEDRON[1:], 4)[match_twins(TETRAHEDRON[1:], 4) < 0]) == [BORDER] * 3
    )
    fan = np.array([[0, 1, 2], [1, 0, 3], [1, 0, 4]], np.int32)  # three triangles at the edge 0-1
    assert (match_twins(fan, 5)[[0, 3, 6]] == CROWDED).all()
    alike = np.array([[0, 1, 2], [0, 1, 3]], np.int32)
    assert (match_twins(alike, 4)[[0, 3]] == CROWDED).all()


def test_a_vertex_with_two_fans_is_recognized() -> None:
    both = np.concatenate([TETRAHEDRON, [[0, 5, 4], [0, 4, 6], [4, 5, 6], [0, 6, 5]]]).astype(
        np.int32
    )
    _, valence = count_fans(both, match_twins(both, 7), 7)
    assert (valence < 0).tolist() == [True] + [False] * 6


def test_components_are_numbered_by_their_first_vertices_and_measured() -> None:
    one, other = ball(2.0), moved(ball(1.0), (9.0, 0.0, 0.0))
    mesh = joined(one, other)
    triangles, count = mesh.triangles.astype(np.int32), len(mesh.positions)
    label, bodies = label_vertices(triangles, count)
    np.testing.assert_array_equal(
        label, np.repeat([0, 1], [len(one.positions), len(other.positions)])
    )
    at = mesh.positions.astype(np.float64)
    volumes = measure_volumes(at, triangles, label, bodies)
    np.testing.assert_allclose(volumes, [enclosed_volume(one), enclosed_volume(other)], rtol=1e-5)
    opened = triangles[:-1]
    areas, is_open = measure_areas(at, opened, match_twins(opened, count), label, bodies)
    sides = measure_boxes(at, label, bodies)
    assert is_open.tolist() == [False, True]
    np.testing.assert_allclose(areas, 4 * np.pi * np.array([4, 1]), rtol=0.03)
    np.testing.assert_allclose(sides, np.repeat([[4.0], [2.0]], 3, axis=1), rtol=0.02)


def test_the_gain_is_the_area_if_all_vertices_move_outwards() -> None:
    mesh = ball(2.0, 60)
    at, triangles = mesh.positions.astype(np.float64), mesh.triangles.astype(np.int32)
    label, bodies = label_vertices(triangles, len(at))
    gain = sum_gains(at, triangles, label, bodies, sum_normals(at, triangles))
    np.testing.assert_allclose(gain, 4 * np.pi * 4, rtol=0.01)


def test_windings_give_six_times_the_volume_along_each_axis_and_the_boxes() -> None:
    one, other = ball(2.0), moved(ball(1.0), (9.0, 0.0, 0.0))
    mesh = joined(one, other)
    triangles, count = mesh.triangles.astype(np.int32), len(mesh.positions)
    turned = triangles.copy()
    # The small ball is wound inwards
    turned[len(one.triangles) :] = turned[len(one.triangles) :, ::-1]
    label, bodies = label_vertices(turned, count)
    assert find_first(turned, label, bodies + 1).tolist() == [0, len(one.triangles), -1]
    at = mesh.positions.astype(np.float64)
    normals = sum_normals(at, triangles).astype(np.float32)
    zero = np.array([[5.0, -3.0, 0.0], [0.0, 1.0, 2.0]])
    along, volumes, low, high = measure_windings(at, normals, turned, label, zero)
    wanted = 6 * np.array([enclosed_volume(one), -enclosed_volume(other)])
    np.testing.assert_allclose(volumes, np.repeat(wanted[:, None], 3, axis=1), rtol=1e-5)
    assert along[0] > 0 > along[1]
    np.testing.assert_allclose(low, [at[label == body].min(axis=0) for body in range(2)])
    np.testing.assert_allclose(high, [at[label == body].max(axis=0) for body in range(2)])


def test_a_box_lies_within_another_only_if_it_does_so_along_all_axes() -> None:
    low = np.array([[0, 0, 0], [1, 1, 1], [1, 1, -1], [0, 0, 0]], np.float64)
    high = np.array([[4, 4, 4], [2, 2, 2], [2, 2, 2], [4, 4, 4]], np.float64)
    asked = np.array([1, 2, 3])
    assert lie_within(low, high, asked, np.array([0])).tolist() == [True, False, True]
    assert lie_within(low, high, asked, np.zeros(0, np.int64)).tolist() == [False] * 3


def test_renumbered_triangles_have_the_same_corners_in_order() -> None:
    triangles = np.array([[9, 2, 5], [2, 7, 9]], np.uint32)
    used, own = renumber_corners(triangles, 12)
    assert used.tolist() == [2, 5, 7, 9]
    np.testing.assert_array_equal(used[own], triangles)
    used, own = renumber_corners(triangles[:0], 12)
    assert (len(used), own.shape) == (0, (0, 3))


def test_a_part_of_a_kernel_can_be_called_from_python() -> None:
    assert doubled_area(np.eye(3), 0, 1, 2) == (1.0, 1.0, 1.0)
