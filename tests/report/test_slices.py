"""Slices of the report: cross-sections against geometry, and the choice of units and levels."""

import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image

from stereocell.model.mesh import Mesh
from stereocell.model.tiling import Box
from stereocell.model.volume import zyx_to_xyz
from stereocell.preview.draw_slices import (
    OUTLINE,
    Slice,
    cross_section,
    cut_middle_planes,
    cut_unit,
    draw_slices,
    voxels_of,
)
from stereocell.report import select_units


def _ball(center_zyx: NDArray[np.float64], radius: float) -> Mesh:
    """Return a ball's mesh in world um: 64 meridians, 33 parallels."""
    polar, azimuth = np.meshgrid(np.linspace(0, np.pi, 33), np.arange(64) * (2 * np.pi / 64))
    directions = [np.cos(polar), np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth)]
    points = center_zyx + radius * np.stack(directions, axis=-1).reshape(-1, 3)
    i, j = (a.ravel() for a in np.indices((64, 32)))
    corner = [i * 33 + j, i * 33 + j + 1, (i + 1) % 64 * 33 + j, (i + 1) % 64 * 33 + j + 1]
    triangles = np.concatenate(
        [np.stack([corner[k] for k in c], 1) for c in ((0, 1, 2), (2, 1, 3))]
    )
    positions = zyx_to_xyz(points).astype(np.float32)
    return Mesh(positions, triangles.astype(np.uint32), np.zeros_like(positions))


# --- slices


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_cross_section_of_a_ball_is_a_circle(axis: int) -> None:
    center, radius, off = np.array([3.0, 5.0, 8.0]), 2.0, 0.7
    ball = _ball(center, radius)
    points = voxels_of(ball, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    segments = cross_section(points, ball.triangles, axis, center[axis] + off)
    assert np.allclose(segments[:, :, axis], center[axis] + off)
    away = np.linalg.norm(segments - center, axis=-1)
    assert away.max() <= radius + 1e-6
    assert away.min() > 0.99 * radius  # facets lie inside the ball by a hair
    length = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=-1).sum()
    assert length == pytest.approx(2 * np.pi * np.sqrt(radius**2 - off**2), rel=0.01)


def test_cross_section_of_a_closed_mesh_is_closed_though_vertices_lie_on_the_plane() -> None:
    ball = _ball(np.zeros(3), 2.0)
    segments = cross_section(voxels_of(ball, (0, 0, 0), (1, 1, 1)), ball.triangles, 0, 0.0)
    ends = np.round(segments[:, :, 1:], 5) + 0.0
    long = (ends[:, 0] != ends[:, 1]).any(axis=1)  # others are points: the plane met a vertex
    _, counts = np.unique(ends[long].reshape(-1, 2), axis=0, return_counts=True)
    assert (counts == 2).all()


def test_plane_beside_the_mesh_gives_no_cross_section() -> None:
    ball = _ball(np.zeros(3), 1.0)
    assert cross_section(voxels_of(ball, (0, 0, 0), (1, 1, 1)), ball.triangles, 2, 5.0).shape == (
        0, 2, 3,
    )  # fmt: skip


def test_world_positions_turn_back_into_voxels() -> None:
    first, spacing = (1.0, -2.0, 0.5), (0.5, 0.2, 0.25)
    index = np.array([[0.0, 0.0, 0.0], [3.0, 1.0, 7.0]])
    world = zyx_to_xyz(index * spacing + np.array(first)).astype(np.float32)
    mesh = Mesh(world, np.zeros((0, 3), np.uint32), world)
    assert voxels_of(mesh, first, spacing) == pytest.approx(index, abs=1e-5)


def _slices() -> list[Slice]:
    """Return a black unit of 12 x 40 x 60 voxels with a ball where y is small and x is large."""
    lattice, first, spacing = Box((2, 10, 20), (14, 50, 80)), (1.0, 2.0, 4.0), (0.5, 0.2, 0.2)
    center = np.array(first) + np.array([6, 8, 48]) * spacing
    volume = np.zeros(lattice.shape, np.uint8)
    planes = cut_middle_planes(volume, lattice, spacing_um=spacing, sigma_um=0.2)
    ball = _ball(center, 1.0)
    return cut_unit(planes, first_um=first, spacing_um=spacing, mesh=ball, iso_at=None)


def test_mid_slices_meet_the_mesh_where_it_lies() -> None:
    xy, xz, yz = _slices()
    assert xy.outline.reshape(-1, 2).mean(axis=0) == pytest.approx([8, 48], abs=0.1)
    assert np.ptp(xy.outline[:, :, 1]) == pytest.approx(10, rel=0.02)  # 2 um of 0.2 um
    assert not len(xz.outline)  # y = 20 and x = 30 pass beside the ball
    assert not len(yz.outline)


def test_picture_shows_the_outline_unmirrored_and_in_proportion() -> None:
    data, width, height = draw_slices(_slices())
    # 12 x 8 x 6 um at 25 pixels a um
    assert (width, height) == (300 + 6 + 150, 200 + 6 + 150)
    picture = np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int)
    amber = picture[:, :, 0] - picture[:, :, 2] > (OUTLINE[0] - OUTLINE[2]) / 4
    rows, columns = np.nonzero(amber)
    assert rows.mean() == pytest.approx(8.5 * 5, abs=2)
    assert columns.mean() == pytest.approx(48.5 * 5, abs=2)


def test_field_minus_iso_value_is_zero_on_a_ramps_own_level() -> None:
    lattice = Box((0, 0, 0), (9, 16, 16))
    ramp = np.broadcast_to(np.arange(16, dtype=np.uint8) * 10, lattice.shape)
    planes = cut_middle_planes(ramp, lattice, spacing_um=(1, 1, 1), sigma_um=0.7)
    slices = cut_unit(
        planes, first_um=(0, 0, 0), spacing_um=(1, 1, 1), mesh=None,
        iso_at=lambda box: np.full(box.shape, 70, np.float32),
    )  # fmt: skip
    by_name = {s.view.name: s.above for s in slices}
    assert list(by_name) == ["xy", "xz", "yz"]
    xy, yz = by_name["xy"], by_name["yz"]
    assert xy is not None
    assert yz is not None
    assert xy[:, 7] == pytest.approx(0, abs=1e-3)
    assert (xy[:, 8] > 5).all()
    assert yz.shape == (16, 9)  # y down, z right
    assert yz == pytest.approx(10, abs=1e-3)  # x = 8


# --- choices


@given(st.integers(1, 400), st.integers(1, 90), st.integers(1, 80))
def test_chosen_units_are_distinct_and_no_more_than_asked_for(
    tiles: int, channels: int, most: int
) -> None:
    chosen = select_units.choose_units(tiles, channels, most)
    units = [(tile, channel) for tile, shown in chosen for channel in shown]
    assert len(set(units)) == len(units) <= max(most, 1)
    assert len({tile for tile, _ in chosen}) == len(chosen)
    assert all(0 <= t < tiles and 0 <= c < channels for t, c in units)
    if tiles * channels <= most:
        assert len(units) == tiles * channels


def test_whole_slide_shows_tiles_from_all_over_and_most_channels() -> None:
    chosen = select_units.choose_units(242, 70, 60)
    assert len(chosen) == 6
    assert chosen[0][0] < 30
    assert chosen[-1][0] > 210
    assert len({channel for _, shown in chosen for channel in shown}) > 50


def test_finest_level_within_the_budget_is_drawn() -> None:
    meshes = [[1000, 100, 10], [500, 50]]
    assert select_units.choose_level(meshes, 2000) == (0, 1)
    assert select_units.choose_level(meshes, 200) == (1, 1)
    assert select_units.choose_level(meshes, 60) == (2, 1)
    assert select_units.choose_level(meshes, 20) == (2, 3)


def test_thinning_out_keeps_the_share_and_all_channels() -> None:
    assert select_units.thin_out(5, 1) == [0, 1, 2, 3, 4]
    kept = select_units.thin_out(70 * 242, 7)
    assert len(kept) == pytest.approx(70 * 242 / 7, rel=0.01)
    assert {i % 70 for i in kept} == set(range(70))
