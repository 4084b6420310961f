"""Charts: their density, their distance, their edges, and levels that get none."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import pyvista as pv
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from stereocell.meshes.simplify import simplify
from stereocell.model.errors import UsageError
from stereocell.model.mesh import Mesh
from stereocell.textures import unwrap as unwrap_module
from stereocell.textures.bake import REACH, fill
from stereocell.textures.options import UnwrapOptions
from stereocell.textures.rasterize import find_texels
from stereocell.textures.unwrap import mip_levels_apart, unwrap
from support.unwrapped import OPTIONS, SPACING, sphere, unwrapped


def charts_of(mesh: Mesh) -> NDArray[np.int32]:
    """Return the number of each triangle's chart. Seams split vertices."""
    a, b, c = mesh.triangles.astype(np.int64).T
    ends = np.concatenate([a, b]), np.concatenate([b, c])
    links = coo_matrix((np.ones(len(ends[0])), ends), (len(mesh.positions),) * 2)
    return connected_components(links, directed=False)[1][a]


def areas(corners: NDArray[np.floating]) -> NDArray[np.floating]:
    sides = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    if corners.shape[2] == 2:
        return np.abs(sides[0][:, 0] * sides[1][:, 1] - sides[0][:, 1] * sides[1][:, 0]) / 2
    return np.linalg.norm(np.cross(*sides), axis=1) / 2


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"first_lod": -1}, "unwrap.first_lod is -1, expected 0 or more"),
        ({"padding": 2}, "unwrap.padding is 2, expected 3 to 24"),
        ({"max_triangles": -1}, "unwrap.max_triangles is -1, expected 0 or more"),
        ({"max_texture": 32}, "max_texture is 32, expected a power of two from 64 to 8192"),
        ({"max_texture": 1000}, "max_texture is 1000, expected a power of two from 64 to 8192"),
        ({"texel_um": 0.0}, "unwrap.texel_um is 0, expected at least 0.0"),
        ({"texel_um": "fine"}, "unwrap.texel_um is 'fine', expected a length in um or 'auto'"),
        ({"occlusion_um": -1.0}, "unwrap.occlusion_um is -1.0, expected a length in um"),
    ],
)
def test_options_out_of_range_are_refused(values: dict[str, Any], message: str) -> None:
    with pytest.raises(UsageError) as raised:
        UnwrapOptions(**values).resolved(SPACING)
    assert message in str(raised.value)


def test_automatic_lengths_follow_the_coarsest_spacing() -> None:
    lengths = (OPTIONS.texel_um, OPTIONS.occlusion_um, OPTIONS.paint_um)
    assert lengths == pytest.approx((0.2, 1.6, 0.4))
    assert OPTIONS.resolved((1.0, 1.0, 1.0)) == OPTIONS


@pytest.mark.parametrize("texel_um", [0.1, 0.25])
def test_a_texel_has_the_stated_length_on_the_surface(texel_um: float) -> None:
    done = unwrapped(simplify(sphere(), 0.1), replace(OPTIONS, texel_um=texel_um))
    height, width = done.size
    assert done.mesh.uvs is not None
    on_map = areas(done.mesh.uvs[done.mesh.triangles].astype(float) * (width, height)).sum()
    on_surface = areas(done.mesh.positions[done.mesh.triangles].astype(float)).sum()
    assert np.sqrt(on_surface / on_map) == pytest.approx(done.texel_um, rel=0.05)
    assert done.texel_um == texel_um
    assert height % 8 == width % 8 == 0


def test_texels_grow_if_the_map_would_be_too_large() -> None:
    done = unwrapped(simplify(sphere(), 0.1), replace(OPTIONS, texel_um=0.05, max_texture=256))
    assert max(done.size) <= 256
    assert done.texel_um > 0.05


def test_a_level_with_too_many_triangles_or_charts_gets_no_maps_and_a_reason() -> None:
    mesh = simplify(sphere(), 0.3)
    assert unwrap(mesh, replace(OPTIONS, max_triangles=10)) == (
        f"{len(mesh.triangles):,} triangles, more than 10"
    )
    reason = unwrap(mesh, replace(OPTIONS, texel_um=0.1, max_texture=64, padding=20))
    assert isinstance(reason, str)
    assert reason.endswith("charts, too many for a map of 64 texels")


def test_charts_do_not_overlap_and_fill_the_map() -> None:
    done = unwrapped(simplify(sphere(), 0.2), replace(OPTIONS, texel_um=0.1))
    height, width = done.size
    assert done.mesh.uvs is not None
    assert done.mesh.uvs.min() >= 0
    assert done.mesh.uvs.max() <= 1
    count = np.zeros(done.size, int)
    for triangle in done.mesh.uvs[done.mesh.triangles] * (width, height):  # a simple rasterizer
        low, high = np.floor(triangle.min(axis=0)).astype(int), np.ceil(triangle.max(axis=0))
        u, v = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
        a, b, c = triangle
        signs = [
            (q[0] - p[0]) * (v - p[1]) - (q[1] - p[1]) * (u - p[0])
            for p, q in ((a, b), (b, c), (c, a))
        ]
        inside = np.all([s > 1e-3 for s in signs], axis=0) | np.all(
            [s < -1e-3 for s in signs], axis=0
        )
        count[v[inside].astype(int), u[inside].astype(int)] += 1
    assert count.max() == 1
    assert (count > 0).mean() > 0.3


@pytest.mark.slow
@pytest.mark.parametrize(("padding", "levels"), [(3, 1), (6, 2), (12, 3)])
def test_lookups_in_a_chart_read_no_other_chart_at_the_stated_mip_levels(
    padding: int, levels: int
) -> None:
    assert mip_levels_apart(padding) == levels
    done = unwrapped(simplify(sphere(), 0.02), replace(OPTIONS, padding=padding, texel_um=0.15))
    mesh = done.mesh
    assert mesh.uvs is not None
    chart = charts_of(mesh)
    assert 4 < len(np.unique(chart)) < 256
    texel, triangle, _, _ = find_texels(mesh.uvs, mesh.triangles, done.size, REACH)
    image = fill(chart[triangle][:, None], texel, done.size)[..., 0]  # as maps are filled

    height, width = done.size
    # Positions on the edges of charts, from which lookups reach farthest
    starts, ends = mesh.triangles.ravel(), np.roll(mesh.triangles, -1, axis=1).ravel()
    share = np.linspace(0, 1, 5)[:, None, None]
    places = mesh.uvs[starts] * share + mesh.uvs[ends] * (1 - share)
    own = np.tile(np.repeat(chart, 3), len(share))
    x, y = (places.reshape(-1, 2) * (width, -height) + (0, height)).T
    mixed = []
    for level in range(levels + 2):
        step, is_mixed = 2**level, np.zeros(len(own), bool)
        for side_x in (0, 1):
            for side_y in (0, 1):
                left = (np.floor(x / step - 0.5).astype(int) + side_x) * step
                top = (np.floor(y / step - 0.5).astype(int) + side_y) * step
                for dx in range(step):
                    for dy in range(step):
                        row = np.clip(top + dy, 0, height - 1)
                        is_mixed |= image[row, np.clip(left + dx, 0, width - 1)] != own
        mixed.append(is_mixed.mean())
    assert max(mixed[:levels]) < 0.002  # rounding of a texel at corners
    assert mixed[-1] > 0.001  # otherwise the test would show nothing


def test_no_chart_crosses_a_sharp_edge() -> None:
    """Our normals are smooth everywhere, so they do not show where a body is sharp."""
    cube = pv.Cube(x_length=4, y_length=4, z_length=4).triangulate().subdivide(3).clean()
    positions = np.asarray(cube.points, np.float32)
    radial = positions / np.linalg.norm(positions, axis=1, keepdims=True)
    mesh = Mesh(positions, cube.regular_faces.astype(np.uint32), radial)
    done = unwrapped(mesh).mesh
    corners = done.positions[done.triangles]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    side = np.rint(facing / np.linalg.norm(facing, axis=1, keepdims=True))
    chart = charts_of(done)
    for number in np.unique(chart):
        assert len(np.unique(side[chart == number], axis=0)) == 1
    assert len(np.unique(chart)) < 20
    np.testing.assert_allclose(done.normals, done.positions / np.linalg.norm(
        done.positions, axis=1, keepdims=True), atol=1e-6)  # fmt: skip


def test_unwrapping_twice_gives_the_same_result() -> None:
    first, second = (unwrapped(simplify(sphere(), 0.1)) for _ in range(2))
    assert first.mesh.uvs is not None
    assert second.mesh.uvs is not None
    np.testing.assert_array_equal(first.mesh.triangles, second.mesh.triangles)
    np.testing.assert_array_equal(first.mesh.uvs, second.mesh.uvs)


def test_an_atlas_is_kept_for_a_few_unwraps() -> None:
    """Destroying an atlas whose worker thread is just falling asleep can hang forever."""
    mesh = simplify(sphere(sides=24), 0.2)
    for _ in range(unwrap_module.ATLASES_KEPT + 3):
        unwrap(mesh, OPTIONS)
    assert len(unwrap_module._past_atlases) == unwrap_module.ATLASES_KEPT
