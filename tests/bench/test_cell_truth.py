"""The measures of `make bench-cells` are right for shapes whose figures are known."""

import numpy as np
import pytest

from bench.cell_truth import BallsCut, VoxelFaces, measure_overlap, numbered, split, volume_of
from stereocell.meshes.distance import Nearest
from stereocell.model.mesh import Mesh
from support.meshes import ball, joined, moved

SAMPLES = 2000


def test_distance_of_two_balls_is_the_difference_of_their_radii() -> None:
    truth = BallsCut(np.array([[3.0, 2.0, 1.0]]), 4.5, SAMPLES)
    found = moved(ball(5.0, 120), (1.0, -2.0, 3.0))  # world (x, y, z) is (x, -y, z) of the array
    away = truth.distances(0, Nearest(found, SAMPLES))
    assert len(away) == 2 * SAMPLES
    np.testing.assert_allclose(away, 0.5, atol=0.005)
    assert truth.volumes[0] == pytest.approx(4 / 3 * np.pi * 4.5**3)
    assert volume_of(found) == pytest.approx(4 / 3 * np.pi * 125, rel=2e-3)


def test_plane_between_two_balls_cuts_both() -> None:
    truth = BallsCut(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 6.0]]), 5.0, SAMPLES)
    height = 2.0  # um, height of the cap beyond the plane
    cap = np.pi * height**2 * (5.0 - height / 3)
    np.testing.assert_allclose(truth.volumes, 4 / 3 * np.pi * 125 - cap, rtol=1e-4)
    points = truth._points(0)
    on_plane = np.isclose(points[:, 0], 3.0)
    np.testing.assert_allclose(np.linalg.norm(points[~on_plane], axis=1), 5.0)
    disc, rest = np.pi * 16, 4 * np.pi * 25 - 2 * np.pi * 5 * height
    # Points are spread evenly over the area.
    assert on_plane.mean() == pytest.approx(disc / (disc + rest), abs=0.01)
    # The cap of a whole ball lies beyond the plane, its top by 2 um.
    away = truth.distances(0, Nearest(ball(5.0, 120), SAMPLES))[:SAMPLES]
    assert away.max() == pytest.approx(height, abs=0.05)
    assert (away < 0.01).mean() == pytest.approx(1 - height / 10, abs=0.01)


def test_box_lies_on_the_faces_of_its_voxels() -> None:
    labels = np.zeros((6, 7, 8), np.int32)
    labels[2:4, 1:4, 3:7] = 1
    spacing = (2.0, 1.0, 0.5)
    truth = VoxelFaces(labels, spacing, SAMPLES)
    assert truth.volumes.tolist() == [24.0]
    z, y, x = np.array([[1.5, 3.5], [0.5, 3.5], [2.5, 6.5]]) * np.array(spacing)[:, None]
    corners = np.stack(np.meshgrid(x, -y, z, indexing="ij"), axis=-1).reshape(-1, 3)
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = np.array([t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))], np.uint32)
    at = corners.astype(np.float32)
    box = Mesh(at, triangles, np.zeros_like(at))
    np.testing.assert_allclose(truth.distances(0, Nearest(box, SAMPLES)), 0, atol=1e-6)
    shifted = truth.distances(0, Nearest(moved(box, (0.0, 0.0, 0.25)), SAMPLES))
    assert shifted.max() == pytest.approx(0.25)


@pytest.mark.slow
def test_overlap_is_a_share_of_the_union() -> None:
    near = [Nearest(ball(5.0, 60), 1), Nearest(moved(ball(5.0, 60), (6.0, 0.0, 0.0)), 1)]
    lens = np.pi * 4 * (3 * 5 - 2) / 3 * 2
    whole = 2 * 4 / 3 * np.pi * 125 - lens
    assert measure_overlap(near, 40_000) == pytest.approx(lens / whole, abs=0.01)
    apart = [near[0], Nearest(moved(ball(5.0, 60), (10.0, 0.0, 0.0)), 1)]
    assert measure_overlap(apart, 40_000) == 0


def test_objects_are_split_by_their_vertices() -> None:
    both = joined(ball(2.0), moved(ball(3.0), (9.0, 0.0, 0.0)))
    objects = np.repeat(np.arange(0, 4, 2, dtype=np.int32), len(ball().positions))
    whole = Mesh(both.positions, both.triangles, both.normals, objects=objects)
    first, none, last = split(whole, 3)
    assert (volume_of(first), volume_of(none)) == (pytest.approx(volume_of(ball(2.0))), 0)
    assert volume_of(last) == pytest.approx(volume_of(ball(3.0)), rel=1e-5)


def test_objects_of_few_voxels_are_left_out() -> None:
    mask = np.array([[0, 7, 9, 9], [8, 9, 7, 0]], np.uint16)
    assert numbered(mask, 2).tolist() == [[0, 1, 2, 2], [0, 2, 1, 0]]
