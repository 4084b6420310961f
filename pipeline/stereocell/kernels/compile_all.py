"""Compile all kernels that are not in the cache, by calling each of them on a tetrahedron.

Two processes compile half of them each, because numba compiles on one core.
"""

import subprocess
import sys

import numpy as np

from stereocell.kernels.atlas import cut_slices
from stereocell.kernels.cache_place import mark_compiled
from stereocell.kernels.closing import close_gaps
from stereocell.kernels.collapse import collapse, collapse_interfaces
from stereocell.kernels.critical import find_critical
from stereocell.kernels.crossings import find_candidates, find_maybe_flat, find_spread
from stereocell.kernels.deflate import MAX_BYTES, make_space
from stereocell.kernels.depth_buffer import find_visible, place_points, weigh_pixels
from stereocell.kernels.flips import flip_edges
from stereocell.kernels.gradients import divide_by_slopes, measure_slopes, move_off_zero
from stereocell.kernels.grid import bound_all, bound_boxes, count_entries, find_near, list_by_cell
from stereocell.kernels.half_edges import (
    count_fans,
    find_first,
    label_vertices,
    lie_within,
    match_twins,
    measure_areas,
    measure_boxes,
    measure_sharpest,
    measure_sides,
    measure_triangles,
    measure_volumes,
    measure_windings,
    renumber_corners,
    sum_gains,
    sum_normals,
)
from stereocell.kernels.hollows import count_faces, find_hollows
from stereocell.kernels.interface_rings import find_orders
from stereocell.kernels.interfaces import (
    bound_objects,
    couple,
    least_of_objects,
    press,
    slope_volumes,
    smooth_interfaces,
)
from stereocell.kernels.level_sums import (
    count_differences,
    sum_along_axes,
    sum_by_value,
    sum_neighbours,
)
from stereocell.kernels.near_order import order_triangles, order_vertices
from stereocell.kernels.nearest import find_nearest, find_sides
from stereocell.kernels.placement import (
    find_places,
    follow_moves,
    move_along,
    shorten_moves,
    sum_planes,
)
from stereocell.kernels.plane_distances import find_far
from stereocell.kernels.rims import thin_rim
from stereocell.kernels.runs import find_runs, join_runs, mark_runs, measure_components
from stereocell.kernels.shading import light_pixels, shrink, shrink_visible
from stereocell.kernels.slopes import find_downhill
from stereocell.kernels.smoothing import smooth_in_place
from stereocell.kernels.solid_counts import count_inside
from stereocell.kernels.triangle_rows import (
    differ,
    rename,
    rename_back,
    repeat_a_corner,
    share_a_plane,
    touch,
)
from stereocell.kernels.union_find import label_pairs
from stereocell.kernels.value_counts import (
    count_codes,
    count_steps,
    count_values,
    look_up,
    measure_steps,
)
from stereocell.kernels.vdb_leaves import HEAD, VOXELS, cut_leaves, pack_halves
from stereocell.kernels.visibility import cast_rays
from stereocell.kernels.xxhash import xxh32

OF_MESHES = "of-meshes"  # argument of the process that compiles the kernels of meshes
_CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float64)
_TRIANGLES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], np.int32)


def compile_all() -> None:
    """Compile all kernels for the array types that builds of microscopes' images pass to them.

    `cut_leaves` is compiled for voxels of other types at its first call, which takes 0.7 s, once.
    """
    command = [sys.executable, "-m", __package__, OF_MESHES]
    with subprocess.Popen(command) as other:
        compile_others()
    if other.returncode:
        raise SystemExit(other.returncode)  # the other process has printed the reason
    mark_compiled()


def compile_of_meshes() -> None:
    """Compile the kernels of meshes and of their grids. They take half of the time."""
    at, triangles, flags = _CORNERS, _TRIANGLES, np.ones(4, bool)
    twins = match_twins(triangles, 4)
    count_fans(triangles, twins, 4)
    labels, bodies = label_vertices(triangles, 4)
    label_pairs(np.arange(2), np.arange(2), 2)
    measure_volumes(at, triangles, labels, bodies)
    measure_areas(at, triangles, twins, labels, bodies)
    measure_boxes(at, labels, bodies)
    find_first(triangles, labels, bodies)
    measure_windings(at, at.astype(np.float32), triangles, labels, np.zeros((bodies, 3)))
    measure_triangles(at, triangles)
    measure_sharpest(at, triangles)
    measure_sides(at, triangles)
    lie_within(at, at, np.arange(2), np.arange(2))
    renumber_corners(triangles.astype(np.uint32), 4)
    sum_gains(at, triangles, labels, bodies, sum_normals(at, triangles))
    bits, errors = np.zeros(4, np.uint8), np.full(4, 0.1)
    order_triangles(triangles, order_vertices(at))
    nothing = np.zeros((0, 2), np.int32)
    follow_moves(nothing, 4)
    moves = find_places(sum_planes(at, triangles, labels, at), 0.1, 0.1)
    shorten_moves(at, triangles, moves, 0.9, 4)
    move_along(at.copy(), moves, errors, at, 0.1, at[0], at[1])
    for each in (triangles, triangles.astype(np.uint32)):
        touch(flags, each)
        differ(each, each)
    repeat_a_corner(triangles)
    share_a_plane(bits, triangles)
    rename_back(labels, rename(labels, triangles, labels), labels, flags)
    left, _, _ = collapse(at, triangles, flags, bits, errors, 3.0, 0.9, nothing)
    flip_edges(at, left, flags, bits, bits, errors, 0.9)
    orders = find_orders(triangles, 4)
    collapse_interfaces(at, triangles, flags, errors, 3.0, 0.9, orders, nothing)
    thin_rim(at, triangles, np.zeros(4, np.int8), np.zeros(4, np.uint8), flags, 0.1, 0.9)

    low, high = bound_boxes(at, triangles)
    origin, edge, shape = low.min(axis=0), 0.5, np.array([3, 3, 3])
    count_entries(low, high, origin, edge)
    bound_all(low, high)
    find_near(low, high, flags, origin, edge, shape)
    first, listed = list_by_cell(low, high, origin, edge, shape)
    find_maybe_flat(at, triangles)
    spread = find_spread(at, triangles)
    find_candidates(at, triangles, flags, spread, low, high, first, listed, origin, edge, shape)
    cells = first, listed, origin, edge, shape
    _, nearest, parts = find_nearest(at, at, triangles, *cells, np.full(4, -1, np.int32), 0)
    find_sides(at, nearest, parts, at, triangles, twins)


def compile_others() -> None:
    """Compile the kernels of voxels, objects, pictures and files."""
    at, triangles = _CORNERS, _TRIANGLES
    sides = np.tile(np.array([0, 1], np.int32), (4, 1))
    entries, own = slope_volumes(at, triangles, sides, np.array([-1, 0], np.int32))
    couple(*entries, own, 1)
    press(*entries, own, np.ones(1))
    bound_objects(at, triangles, sides, 2)
    least_of_objects(triangles, sides, own, 1.0, 4)
    smooth_interfaces(at, np.arange(5, dtype=np.int32), triangles[:, 0].copy(), own, 0.5)
    find_critical(np.zeros((3, 3, 3), np.int32), 1)
    xxh32(bytes(7))
    voxels, points = np.zeros((3, 3, 3), np.float32), np.ones((2, 3), np.float32)
    find_downhill(voxels, points.astype(np.float64), np.ones(3))
    near, which = np.full((1, 1), -np.inf), np.zeros((1, 1), np.int32)
    mesh_of, picture = np.zeros((1, 1), np.int32), np.ones((1, 1, 3))
    corners, heights = np.ascontiguousarray(at[:, :2]), np.ones(4)
    drawn = triangles.astype(np.uint32)
    for each in (at, at.astype(np.float32)):
        place_points(each, at[0], at[:3], 1.0, corners[0], corners.copy(), heights.copy())
    find_visible(corners, heights, drawn, 0, near, mesh_of, which)
    weigh_pixels(np.zeros(1, np.int64), 1, which, drawn, corners)
    visible, lamps = (mesh_of, which, drawn, corners), np.ones((1, 7))
    light_pixels(0, *visible, at.astype(np.float32), at, at[:3], lamps, 0.1, 0.1, 0.1, picture)
    shrink(picture, 1, picture)
    shrink_visible(picture, near, 1, picture, near)
    one = np.ones(1, np.float32)
    cast_rays(voxels > 0, points, points, points, points, one, one)

    weights, steps = np.ones(1), np.ones(3)
    smooth_in_place(voxels, weights, weights, weights, True, np.float32(1))
    measure_slopes(voxels, steps)
    divide_by_slopes(voxels, steps, 1e-6, 2.0)
    mask, every = voxels > 0, np.array([[0, 3]] * 3, np.int64)
    one_bin, small, ones = np.zeros(1 << 16, np.int16), np.float32(0.1), np.ones(9, np.int64)
    sum_by_value(voxels, mask, every, steps, one_bin, small, small, small, 1)
    count_differences(voxels, mask, every, 1, one_bin, steps)
    sum_along_axes(voxels, mask, every)
    count_values(steps, ones[:3], np.arange(2.0), 0.0, 1.0, True, np.zeros(1, np.int64))
    codes, table = np.zeros(3, np.uint16), np.zeros(256, np.uint8)
    count_codes(codes, np.zeros(1 << 16, np.int64))
    look_up(codes, table, table[:3])
    grey, gradients = np.zeros((3, 3, 3), np.uint8), np.zeros((1, 1, 1), np.float32)
    measure_steps(grey, points[0], gradients)
    count_steps(gradients[0], grey[0], small, np.zeros((1, 256), np.int64))
    find_far(mask, steps, 1.0)
    count_faces(find_hollows(mask).astype(np.uint32), mask, mask, 2)
    count_inside(voxels, mask, ones, ones, ones.astype(np.float32))
    sum_neighbours(np.zeros((3, 3)), mask[0], every[1:], steps, np.zeros((7, 3)))
    move_off_zero(voxels, np.float32(0.01))
    close_gaps(voxels, steps, 1.0, 1.0)
    first_run, start, stop = find_runs(mask)
    components, touching, count = join_runs(first_run, start, stop, 3, True)
    measure_components(first_run, start, stop, components, touching, count, (3, 3, 3))
    mark_runs(first_run, start, stop, components, np.ones(count, bool), mask)

    fixed = {name: np.zeros((2, 2, 2), name)[:, ::-1] for name in ("u1", "u2")}
    for array in fixed.values():
        array.flags.writeable = False
    corner, bits = np.zeros((1, 3), np.int64), np.zeros((1, VOXELS // 8), np.uint8)
    halves, floats = np.zeros(VOXELS, np.uint16), np.zeros(VOXELS, np.float32)
    cut_leaves(fixed["u1"], corner, np.zeros(256, np.uint16), np.uint16(0), bits, halves)
    cut_leaves(fixed["u2"], corner, None, np.float32(0), bits, floats)
    cut_slices(
        np.zeros((2, 2), np.uint16), np.zeros(1 << 16, np.uint8), np.zeros((2, 2, 2), np.uint8)
    )
    ends, packed = np.array([VOXELS]), np.zeros(HEAD + MAX_BYTES, np.uint8)
    pack_halves(bits, ends, halves, make_space(), packed)
