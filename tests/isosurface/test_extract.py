"""Iso-surfaces compared with analytic bodies, and across tiles."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.filters.denoise import smooth
from stereocell.filters.reach import SMOOTHING_REACH
from stereocell.isosurface.distance_field import gradient_magnitude, signed_distance
from stereocell.isosurface.extract import extract_surface
from stereocell.isosurface.repair import repair
from stereocell.isosurface.repair_options import RepairOptions
from stereocell.meshes.validity import find_defects
from stereocell.model.lattice import Lattice
from stereocell.model.mesh import Mesh
from stereocell.model.tiling import Box, cut
from stereocell.model.volume import Volume, zyx_to_xyz
from support.meshes import enclosed_volume, open_edges
from support.phantoms import blurred_ball, f_phantom

SPACING = (0.28, 0.14, 0.14)
OPTIONS = RepairOptions(alpha_um=0.56, min_diagonal_um=0.84, max_cavity_um=1.1)


def _extract(
    voxels: NDArray[np.float32], window: Box, lattice: Box, region: Box, iso: float
) -> Mesh:
    field = smooth(Volume(voxels[window.slices], SPACING), 0.14)
    distance = signed_distance(field, np.float32(iso), spacing_um=SPACING, value_range=1000.0)
    repaired = repair(distance, SPACING, options=OPTIONS)
    return extract_surface(
        repaired.distance, Lattice(window, lattice, region, SPACING, (0.0, 0.0, 0.0))
    )


def _whole(voxels: NDArray[np.float32], iso: float) -> Mesh:
    region = Box((0, 0, 0), voxels.shape)  # type: ignore[arg-type]
    return _extract(voxels, region, region, region, iso)


def test_blurred_ball_gives_its_volume_within_two_percent() -> None:
    radius = 3.0
    ball = blurred_ball((48, 90, 90), SPACING, (6.5, 6.2, 6.2), radius, 0.15)
    mesh = _whole(1000 * ball, 500.0)
    assert enclosed_volume(mesh) == pytest.approx(4 / 3 * np.pi * radius**3, rel=0.02)
    assert open_edges(mesh) == 0


def test_surface_lies_on_the_analytic_boundary() -> None:
    center, radius = np.array([6.5, 6.2, 6.2]), 3.0
    ball = blurred_ball((48, 90, 90), SPACING, tuple(center), radius, 0.2)
    mesh = _whole(1000 * ball, 500.0)
    world = zyx_to_xyz(center)
    distance = np.abs(np.linalg.norm(mesh.positions - world, axis=1) - radius)
    assert distance.mean() < 0.5 * min(SPACING)


def test_normals_point_outwards_and_match_the_triangles() -> None:
    center = np.array([6.5, 6.2, 6.2])
    mesh = _whole(1000 * blurred_ball((48, 90, 90), SPACING, tuple(center), 3.0, 0.2), 500.0)
    radial = mesh.positions - zyx_to_xyz(center)
    radial /= np.linalg.norm(radial, axis=1, keepdims=True)
    assert (radial * mesh.normals).sum(axis=1).min() > 0.9
    assert enclosed_volume(mesh) > 0


def test_body_at_the_end_of_the_data_is_capped() -> None:
    ball = blurred_ball((24, 48, 48), SPACING, (0.0, 3.2, 3.2), 2.0, 0.2)
    mesh = _whole(1000 * ball, 500.0)
    assert open_edges(mesh) == 0
    cap = mesh.positions[:, 2] < -0.1 * SPACING[0]
    rim = np.linalg.norm(mesh.positions[:, :2] - [3.2, -3.2], axis=1) > 1.6
    assert (cap & ~rim).sum() > 100
    assert mesh.normals[cap & ~rim, 2].max() < -0.99  # the cap faces away from the body


def test_a_cavity_that_the_block_s_face_cuts_is_valid_without_a_cap() -> None:
    """The solid around the cavity fills the block, and has no other surface."""
    hole = 3 - np.linalg.norm(
        np.indices((12, 16, 16)) - np.reshape([11, 8, 8], (3, 1, 1, 1)), axis=0
    )
    box = Box((0, 0, 0), hole.shape)  # type: ignore[arg-type]
    lattice = replace(Lattice.of_whole(box, (1.0, 1.0, 1.0)), cap=None)
    mesh = extract_surface(np.clip(-hole, -2, 2).astype(np.float32), lattice)
    assert len(mesh.triangles) > 50
    assert open_edges(mesh) > 10
    assert find_defects(mesh, planes=lattice.cut_planes()).total == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("axis", "tile_size"), [(2, (48, 100, 50)), (1, (48, 50, 100)), (0, (24, 100, 100))]
)
def test_tiles_meet_without_cracks(axis: int, tile_size: tuple[int, int, int]) -> None:
    rng = np.random.default_rng(3)
    voxels = np.zeros((48, 100, 100), np.float32)
    for center in rng.uniform([2, 2, 2], [11, 12, 12], (14, 3)):
        voxels += 1000 * blurred_ball(voxels.shape, SPACING, tuple(center), 1.6, 0.2)
    voxels += rng.normal(0, 40, voxels.shape)
    region = Box((0, 0, 0), (48, 100, 100))
    reach = OPTIONS.reach_um(SPACING) + SMOOTHING_REACH * 0.14
    halo = tuple(int(np.ceil(reach / step)) + 2 for step in SPACING)
    plane = np.float32(tile_size[axis] * SPACING[axis])
    coordinate = 2 - axis
    rims = []
    for tile in cut(region, tile_size):
        lattice = tile.lattice(region)
        mesh = _extract(voxels, lattice.grown(halo, region), lattice, region, 500.0)
        on_plane = np.abs(mesh.positions[:, coordinate]) == plane
        rims.append({row.tobytes() for row in mesh.positions[on_plane]})
    assert len(rims[0]) > 50
    assert rims[0] == rims[1]


def test_gradient_of_a_ramp_is_its_slope_in_um() -> None:
    z, _, x = np.indices((5, 6, 7), dtype=np.float32)
    ramp = (3 * z * 0.28 + 4 * x * 0.14).astype(np.float32)
    np.testing.assert_allclose(gradient_magnitude(ramp, SPACING), 5, rtol=1e-4)


@pytest.mark.parametrize("exponent", [-110, -70, 70, 110])
def test_gradient_of_huge_and_tiny_voxels_has_the_same_digits(exponent: int) -> None:
    field = np.random.default_rng(0).normal(0, 1, (6, 7, 8)).astype(np.float32)
    scale = np.float32(2.0**exponent)
    plain = gradient_magnitude(field, SPACING)
    np.testing.assert_array_equal(gradient_magnitude(field * scale, SPACING), plain * scale)
    distance = signed_distance(field * scale, scale, spacing_um=SPACING, value_range=float(scale))
    np.testing.assert_array_equal(
        distance, signed_distance(field, np.float32(1), spacing_um=SPACING, value_range=1.0)
    )


def test_an_f_keeps_its_orientation_in_world_space() -> None:
    body = f_phantom().astype(np.float32)
    mesh = _whole(body, 550.0)
    depth, height, width = ((n - 1) * step for n, step in zip(body.shape, SPACING, strict=True))
    x, y, z = mesh.positions.T
    assert x.min() >= 0
    assert x.max() <= width
    assert y.max() <= 0  # rows grow downwards
    assert y.min() >= -height
    assert z.max() <= depth
    # The stem is on the left, the long arm on top. The foot is at the bottom, nearer to the viewer.
    assert (x < width / 2).mean() > 0.6
    right = x > 24 * SPACING[2]
    assert right.any()
    assert y[right].mean() > -height / 2
    foot = z > 9 * SPACING[0]
    assert foot.any()
    assert y[foot].mean() < -height / 2
