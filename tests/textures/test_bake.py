"""Baked maps: tangents by the rules, the fine surface's normals, and no seam at a cut."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.isosurface.repair_options import RepairOptions
from stereocell.meshes.simplify import simplify
from stereocell.model.lattice import Lattice
from stereocell.model.lattice_field import LatticeField
from stereocell.model.mesh import Lod, Mesh
from stereocell.model.tiling import Box
from stereocell.model.volume import Volume, zyx_to_xyz
from stereocell.planning.settings import Settings
from stereocell.planning.unit_steps import unit_options
from stereocell.report.texture_similarity import sample
from stereocell.steps.unit import UnitInput, build_unit
from stereocell.textures.ambient_occlusion import find_ambient_visibility
from stereocell.textures.ambient_occlusion import sphere as directions
from stereocell.textures.bake import Baker, bake
from stereocell.textures.tangents import make_tangents
from support.unwrapped import OPTIONS, bare, sphere, unwrapped

FINE = replace(OPTIONS, texel_um=0.1)


def test_tangents_follow_mikktspace() -> None:
    """Apply the rules again, corner by corner, in a simple way."""
    done = unwrapped(simplify(sphere(), 0.1)).mesh
    assert done.uvs is not None
    expected, sign = np.zeros((len(done.positions), 3)), np.zeros(len(done.positions))
    for triangle in done.triangles:
        p, st = done.positions[triangle].astype(float), done.uvs[triangle].astype(float)
        (s1, t1), (s2, t2) = st[1] - st[0], st[2] - st[0]
        signed = s1 * t2 - t1 * s2
        if signed == 0:
            continue
        along = (t2 * (p[1] - p[0]) - t1 * (p[2] - p[0])) * np.sign(signed)
        for k, vertex in enumerate(triangle):
            n = done.normals[vertex].astype(float)
            to = [p[(k + j) % 3] - p[k] for j in (1, 2)]
            to = [e - n * (n @ e) for e in to]
            cosine = to[0] @ to[1] / (np.linalg.norm(to[0]) * np.linalg.norm(to[1]))
            laid = along - n * (n @ along)
            angle = np.arccos(np.clip(cosine, -1, 1))
            expected[vertex] += angle * laid / np.linalg.norm(laid)
            sign[vertex] += angle * np.sign(signed)
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    found = make_tangents(done)
    assert (np.sum(found[:, :3] * expected, axis=1) > np.cos(np.radians(0.1))).mean() > 0.999
    np.testing.assert_array_equal(found[:, 3], np.sign(sign))


def test_tangents_are_unit_vectors_across_the_normals() -> None:
    mesh = unwrapped(simplify(sphere(), 0.2)).mesh
    assert mesh.tangents is not None
    np.testing.assert_allclose(np.linalg.norm(mesh.tangents[:, :3], axis=1), 1, atol=1e-4)
    assert np.abs((mesh.tangents[:, :3] * mesh.normals).sum(axis=1)).max() < 1e-3


def shade(lod: Lod, triangle: NDArray, weights: NDArray) -> NDArray[np.float64]:
    """Return the normals (n, 3) that a renderer finds at positions of triangles."""
    mesh = lod.mesh
    assert mesh.uvs is not None
    assert mesh.tangents is not None
    assert lod.normal_map is not None
    corners = mesh.triangles[triangle]
    smooth, tangent, uvs = (
        np.einsum("nk,nkd->nd", weights, values[corners].astype(float))
        for values in (mesh.normals, mesh.tangents[:, :3], mesh.uvs)
    )
    smooth /= np.linalg.norm(smooth, axis=1, keepdims=True)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    bitangent = np.cross(smooth, tangent) * mesh.tangents[corners[:, 0], 3:]
    x, y, z = (sample(lod.normal_map[..., k], uvs)[:, None] / 127.5 - 1 for k in range(3))
    shaded = x * tangent + y * bitangent + z * smooth
    return shaded / np.linalg.norm(shaded, axis=1, keepdims=True)


def degrees(a: NDArray, b: NDArray) -> NDArray[np.float64]:
    return np.degrees(np.arccos(np.clip((a * b).sum(axis=1), -1, 1)))


def rippled(positions: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return unit normals of a sphere with ripples that no coarse vertex normal can show."""
    radial = positions / np.linalg.norm(positions, axis=1, keepdims=True)
    x, y, z = radial.T
    ripples = radial + 0.35 * np.stack([np.sin(9 * y), np.sin(9 * z), np.sin(9 * x)], axis=1)
    return ripples / np.linalg.norm(ripples, axis=1, keepdims=True)


@pytest.mark.slow
def test_a_baked_map_gives_the_normals_of_the_fine_surface() -> None:
    """A coarse sphere that is shaded by its map has the fine normals, with all ripples."""
    body = sphere()
    fine = replace(body, normals=rippled(body.positions).astype(np.float32))
    done = unwrapped(simplify(body, 0.4), FINE)
    maps = bake(done.mesh, done.size, Baker(bare(fine)))
    lod = Lod(done.mesh, 0.0, maps.normals)
    every = np.arange(len(done.mesh.triangles))
    for weights in ([1 / 3, 1 / 3, 1 / 3], [0.98, 0.01, 0.01], [0.5, 0.5, 0.0]):
        places = np.tile(weights, (len(every), 1))
        truth = rippled(np.einsum("nk,nkd->nd", places, done.mesh.positions[done.mesh.triangles]))
        off = degrees(shade(lod, every, places), truth)
        smooth = np.einsum("nk,nkd->nd", places, done.mesh.normals[done.mesh.triangles])
        smooth /= np.linalg.norm(smooth, axis=1, keepdims=True)
        assert np.median(degrees(smooth, truth)) > 12  # without the map, normals are far off
        assert np.median(off) < 1.5
        assert np.percentile(off, 95) < 5
    assert maps.openness.min() == 255
    assert maps.paint is None


@pytest.mark.slow
def test_a_baked_map_of_a_thin_shell_never_shows_the_other_wall() -> None:
    """A chord of a coarse mesh is nearer to the inner wall's triangles than to the outer wall's."""
    outer, inner = sphere(5.0, 24), sphere(4.8, 96)
    turned = inner.triangles[:, ::-1] + np.uint32(len(outer.positions))
    shell = Mesh(
        np.concatenate([outer.positions, inner.positions]),
        np.concatenate([outer.triangles, turned]),
        np.concatenate([outer.normals, -inner.normals]),
    )
    done = unwrapped(simplify(sphere(), 0.5), FINE)
    maps = bake(done.mesh, done.size, Baker(bare(shell)))
    assert maps.normals[..., 2].min() > 128 + 50  # no normal faces away


def test_openness_is_the_visible_share_of_the_sky() -> None:
    """Beside a wall half of the sky is hidden, as far as rays reach; on an open floor none is."""
    box = Box((0, 0, 0), (24, 80, 80))
    z, _, x = np.indices(box.shape)
    solid = (z < 10) | (x < 20)
    along = np.array([20.5, 21.5, 23.5, 26.5, 40.0])
    at = np.stack([np.full(5, 9.5), np.full(5, 40.0), along], axis=1)  # on the floor
    points = zyx_to_xyz(at).astype(np.float32)
    up = np.tile(np.float32([0, 0, 1]), (5, 1))
    floor = Mesh(points, np.zeros((0, 3), np.uint32), up)
    lattice = Lattice.of_whole(box, (1.0, 1.0, 1.0))
    radius = 8.0
    found = find_ambient_visibility(solid, lattice, floor, radius_um=radius)
    sky = directions(20000)
    sky = sky[sky[:, 2] > 0]
    for value, distance in zip(found, along - 19.5, strict=True):
        to_wall = distance / np.maximum(-sky[:, 0], 1e-9)
        hidden = np.clip(1 - to_wall / radius, 0, 1)
        expected = 1 - (hidden * sky[:, 2]).sum() / sky[:, 2].sum()
        assert value == pytest.approx(expected, abs=0.06)
    assert found[-1] == 1
    none = find_ambient_visibility(solid, lattice, floor, radius_um=0.0)
    assert (none == 1).all()


# --- neighbouring tiles

SPACING = (1.0, 1.0, 1.0)
REGION = Box((0, 0, 0), (48, 48, 64))
CUT = 31
LATTICES = (Box((0, 0, 0), (48, 48, CUT + 1)), Box((0, 0, CUT), (48, 48, 64)))
HALO = (24, 24, 24)


@pytest.fixture(scope="module")
def neighbours() -> tuple[tuple[Lod, ...], ...]:
    """Return two units whose common plane cuts bodies at all angles, some of them near others."""
    rng = np.random.default_rng(3)
    grid = np.indices(REGION.shape).transpose(1, 2, 3, 0)
    inside = np.zeros(REGION.shape, bool)
    for radius in (9, 8, 8, 7, 7, 6, 6):
        middle = rng.uniform([10, 10, CUT - 6], [38, 38, CUT + 6])
        inside |= np.linalg.norm(grid - middle, axis=-1) < radius
    field = ndimage.gaussian_filter(1000.0 * inside, 1.5).astype(np.float32)
    settings = Settings()
    settings = replace(
        settings,
        surface=settings.surface.resolved(SPACING),
        lod=replace(settings.lod, errors=(0.1, 0.4, 0.8)),
        unwrap=replace(settings.unwrap, maps=True).resolved(SPACING),
    )
    iso = LatticeField(((24.0,), (24.0,), (32.0,)), np.full((1, 1, 1), 500.0))
    built = []
    for lattice in LATTICES:
        window = lattice.grown(HALO, REGION)
        given = UnitInput(
            lattice=Lattice(window, lattice, REGION, SPACING, (0.0, 0.0, 0.0)),
            iso=iso,
            background=None,
            repair=RepairOptions(2.0, 3.0, 3.0),
            step=(1, 1, 1),
            intensity_window=(0.0, 1000.0),
            options=unit_options(settings),
        )
        built.append(build_unit(Volume(field[window.slices], SPACING), given).lods)
    return tuple(built)


def on_the_cut(lod: Lod) -> dict[bytes, tuple[NDArray[np.float64], float]]:
    """Return normal and openness, as shaded, at positions of the border on the common plane."""
    mesh = lod.mesh
    assert lod.baked is not None
    assert mesh.uvs is not None
    places, triangles, weights = [], [], []
    for k in range(3):
        ends = mesh.triangles[:, [k, (k + 1) % 3]]
        on_plane = (mesh.positions[ends][:, :, 0] == CUT).all(axis=1)
        at = mesh.positions[ends[on_plane]].astype(np.float64)
        for share in (0.0, 0.25, 0.5):
            for first, second in ((share, 1 - share), (1 - share, share)):
                weight = np.zeros((on_plane.sum(), 3))
                weight[:, k], weight[:, (k + 1) % 3] = first, second
                # The sum is the same whichever end comes first.
                places.append(np.round(first * at[:, 0] + second * at[:, 1], 4) + 0.0)
                triangles.append(np.flatnonzero(on_plane))
                weights.append(weight)
    triangle, weight = np.concatenate(triangles), np.concatenate(weights)
    uvs = np.einsum("nk,nkd->nd", weight, mesh.uvs[mesh.triangles[triangle]].astype(float))
    shaded = shade(lod, triangle, weight)
    openness = sample(lod.baked.openness, uvs) / 255
    rows = zip(np.concatenate(places), shaded, openness, strict=True)
    return {place.tobytes(): (normal, float(share)) for place, normal, share in rows}


@pytest.mark.slow
@pytest.mark.parametrize("level", [1, 2])
def test_neighbours_have_the_same_shading_along_the_cut(
    neighbours: tuple[tuple[Lod, ...], ...], level: int
) -> None:
    ours, theirs = (on_the_cut(lods[level]) for lods in neighbours)
    common = sorted(ours.keys() & theirs.keys())
    assert len(common) > 150
    assert len(common) > 0.9 * len(ours)
    a, b = (np.array([side[place][0] for place in common]) for side in (ours, theirs))
    angle = degrees(a, b)
    assert np.percentile(angle, 99) < 2, (np.median(angle), angle.max())
    open_a, open_b = (np.array([side[place][1] for place in common]) for side in (ours, theirs))
    assert open_a.min() < 0.9  # otherwise the test would show nothing
    assert np.percentile(np.abs(open_a - open_b), 99) < 0.05


def test_levels_record_their_values_and_maps(neighbours: tuple[tuple[Lod, ...], ...]) -> None:
    for lods in neighbours:
        first = lods[0].baked
        assert first is not None
        assert first.openness.shape == (len(lods[0].mesh.positions),)
        assert first.reason == "finer than lod1"
        for lod in lods[1:]:
            assert lod.baked is not None
            assert lod.normal_map is not None
            assert lod.baked.openness.shape == lod.normal_map.shape[:2]
            assert lod.baked.texel_um == 1.0
            assert lod.baked.charts > 2  # at least a part of a ball and its cap


@pytest.mark.slow
def test_baking_twice_gives_the_same_maps() -> None:
    body = sphere(sides=48)
    fine = replace(body, normals=rippled(body.positions).astype(np.float32))
    images = []
    for _ in range(2):
        done = unwrapped(simplify(body, 0.3), FINE)
        images.append(bake(done.mesh, done.size, Baker(bare(fine))))
    np.testing.assert_array_equal(images[0].normals, images[1].normals)
    np.testing.assert_array_equal(images[0].openness, images[1].openness)
