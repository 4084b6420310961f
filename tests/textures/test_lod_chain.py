"""Levels of detail as written: valid, with their borders, measured and recorded."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
import pyvista as pv
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.isosurface.extract import extract_surface
from stereocell.meshes import simplify_valid
from stereocell.meshes.distance import Nearest, measure_enclosure, measure_spread
from stereocell.meshes.options import LodOptions
from stereocell.meshes.simplify import STRAY, simplify
from stereocell.meshes.simplify_valid import Simplified, simplify_without_defects
from stereocell.meshes.validity import border, find_defects
from stereocell.model.lattice import Lattice, Plane
from stereocell.model.mesh import Lod, Mesh
from stereocell.model.tiling import Box
from stereocell.model.timing import Clock
from stereocell.planning.settings import Settings
from stereocell.textures import lod_chain
from stereocell.textures.lod_chain import make_levels, sharpest_angle
from stereocell.textures.options import UnwrapOptions
from stereocell.textures.texture_lod import Texturer, VertexValues
from support.meshes import ball, crowd, enclosed_volume, joined, kinds, moved, to_mesh
from support.unwrapped import bare

SPACING = (1.0, 1.0, 1.0)
ORIGIN = (0.0, 0.0, 0.0)
REGION = Box((0, 0, 0), (40, 40, 60))
LATTICE = Box((0, 0, 0), (40, 40, 31))
PLANES = Lattice(LATTICE, LATTICE, REGION, SPACING, ORIGIN).cut_planes()


@pytest.fixture(scope="module")
def sponge() -> Mesh:
    """Return smoothed noise: handles, thin walls and bodies side by side, cut by a plane."""
    noise = np.random.default_rng(0).normal(size=REGION.shape)
    field = ndimage.gaussian_filter(noise, 1.6)
    distance = np.clip((field - 0.3 * field.std()) / field.std(), -2, 2).astype(np.float32)
    part = distance[LATTICE.slices]
    return extract_surface(part, Lattice(LATTICE, LATTICE, REGION, SPACING, ORIGIN))


def _chain(mesh: Mesh) -> Iterator[Simplified]:
    for error in (0.1, 0.5, 2.0, 4.0):
        simplified = simplify_without_defects(mesh, PLANES, max_error_um=error)
        yield simplified
        mesh = simplified.mesh


def _settings(errors: tuple[float, ...]) -> Settings:
    """Return settings for levels with these errors."""
    settings = Settings()
    return replace(
        settings,
        surface=settings.surface.resolved(SPACING),
        lod=replace(settings.lod, errors=errors),
    )


def _rim(mesh: Mesh) -> set[bytes]:
    return {ends.tobytes() for ends in mesh.positions[border(mesh.triangles)]}


def test_simplification_alone_causes_defects_in_this_mesh(sponge: Mesh) -> None:
    """Otherwise the tests below would show nothing."""
    assert kinds(find_defects(sponge, planes=PLANES)) == set()
    assert kinds(find_defects(simplify(sponge, 2.0, planes=PLANES), planes=PLANES)) == {"crossings"}


@pytest.mark.slow
def test_every_level_is_valid_and_keeps_its_border(sponge: Mesh) -> None:
    levels = list(_chain(sponge))
    for level in levels:
        assert kinds(find_defects(level.mesh, planes=PLANES)) == set()
        assert _rim(level.mesh) == _rim(sponge)
        assert level.fallbacks == 0
    assert any(level.simplified_again for level in levels)
    counts = [len(sponge.triangles), *(len(level.mesh.triangles) for level in levels)]
    assert counts == sorted(counts, reverse=True)
    assert counts[-1] < 0.15 * counts[0]


def test_a_body_that_cannot_be_simplified_keeps_its_surface_and_is_counted(
    sponge: Mesh, monkeypatch: pytest.MonkeyPatch
) -> None:
    alone = moved(ball(1.0), (15.0, -20.0, -9.0))
    start = np.uint32(len(sponge.positions))
    both = Mesh(
        np.concatenate([sponge.positions, alone.positions]),
        np.concatenate([sponge.triangles, alone.triangles + start]),
        np.concatenate([sponge.normals, alone.normals]),
    )
    monkeypatch.setattr(simplify_valid, "ROUNDS", 0)
    kept = simplify_without_defects(both, PLANES, max_error_um=2.0)
    assert kept.fallbacks > 0
    assert kinds(find_defects(kept.mesh, planes=PLANES)) == set()
    assert len(kept.mesh.triangles) > 0.5 * len(sponge.triangles)  # most of the sponge is one body
    # The ball is simplified
    assert (kept.mesh.positions[:, 2] < -5).sum() < 0.5 * len(alone.positions)


@pytest.mark.slow
def test_a_mesh_with_defects_keeps_the_bodies_that_have_them() -> None:
    """Defects are not hidden: the check still finds them."""
    holed = replace(ball(), triangles=ball().triangles[1:])
    done = simplify_without_defects(holed, (), max_error_um=0.5)
    assert done.fallbacks == 1
    np.testing.assert_array_equal(done.mesh.triangles, holed.triangles)
    assert kinds(find_defects(done.mesh)) == {"open"}


@pytest.fixture(scope="module")
def with_process() -> Mesh:
    """Return a body of radius 9.5 at x = 15 with a process of radius 1.3 that ends at x = 71."""
    shape = (40, 40, 80)
    z, y, x = (axis.astype(np.float64) for axis in np.indices(shape))
    body = 9.5 - np.sqrt((z - 19.4) ** 2 + (y - 19.6) ** 2 + (x - 15.3) ** 2)
    along = np.clip(x, 15, 70)
    process = 1.3 - np.sqrt((z - 19.4) ** 2 + (y - 19.6) ** 2 + (x - along) ** 2)
    whole = Box((0, 0, 0), shape)
    distance = np.clip(np.maximum(body, process), -2, 2).astype(np.float32)
    return extract_surface(distance, Lattice.of_whole(whole, SPACING, origin_um=ORIGIN))


def _farthest(mesh: Mesh, simplified: Mesh) -> float:
    """Return the largest distance of a vertex of `mesh` from the other mesh."""
    return float(Nearest(simplified, 10).distances(mesh.positions.astype(np.float64)).max())


def test_a_thin_process_stays(with_process: Mesh) -> None:
    done = simplify_without_defects(with_process, (), max_error_um=2.0)
    assert _farthest(with_process, done.mesh) <= STRAY * 2.0
    assert kinds(find_defects(done.mesh)) == set()
    assert done.fallbacks == 0
    assert len(done.mesh.triangles) < 0.25 * len(with_process.triangles)


def test_each_level_is_near_the_one_before_and_keeps_the_process(with_process: Mesh) -> None:
    errors = (0.1, 0.5, 2.0)
    lods = _levels(with_process, (), _settings(errors))
    tip = float(with_process.positions[:, 0].max())
    for before, lod, error in zip(lods, lods[1:], errors[1:], strict=False):
        # The bound allows one error more, for the move that restores the volumes.
        assert _farthest(before.mesh, lod.mesh) <= (STRAY + 1) * error
        assert lod.mesh.positions[:, 0].max() > tip - 8
        assert lod.quality is not None
        assert lod.quality.away.max < 8


@pytest.mark.slow
def test_each_level_has_the_fine_volume(sponge: Mesh) -> None:
    """This holds for an open mesh too: its border is the same at all levels."""
    settings = _settings((0.1, 0.5, 1.0))
    for fine, planes in ((ball(4.0, 60), ()), (sponge, PLANES)):
        whole = enclosed_volume(fine)
        solid = whole if not planes else 0.38 * 39 * 39 * 30  # volume of the noise above .3 sigma
        for lod in _levels(fine, planes, settings):
            assert abs(enclosed_volume(lod.mesh) - whole) < 0.005 * solid
            assert _rim(lod.mesh) == _rim(fine)


@pytest.mark.slow
def test_bodies_without_space_for_their_volume_are_simplified_less(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fine, settings = crowd(), _settings((0.1, 0.35, 1.1, 4.0))
    volumes, faces = [], []
    for tries in (lod_chain.FINER, ()):
        monkeypatch.setattr(lod_chain, "FINER", tries)
        lods = _levels(fine, (), settings)
        volumes.append([enclosed_volume(lod.mesh) / enclosed_volume(fine) for lod in lods])
        faces.append([len(lod.mesh.triangles) for lod in lods])
        assert {kind for lod in lods for kind in kinds(find_defects(lod.mesh))} == set()
    assert min(volumes[0]) > 0.99
    assert min(volumes[1]) < 0.98
    assert faces[0][:2] == faces[1][:2]  # nothing changes while all have space
    assert faces[0][2] > faces[1][2]
    monkeypatch.setattr(lod_chain, "FINER", (0.0,))  # as many triangles as the level before
    monkeypatch.setattr(lod_chain, "MAX_MORE", 0)
    heavy = [len(lod.mesh.triangles) for lod in _levels(fine, (), settings)]
    assert max(a / b for a, b in zip(heavy, faces[1], strict=True)) <= lod_chain.MAX_HEAVIER


def test_small_bodies_are_removed_from_the_level_that_would_make_them_thin() -> None:
    large, small = ball(10.0, 60), moved(ball(0.8, 20), (15.0, 0.0, 0.0))
    fine = joined(large, small)
    lods = _levels(fine, (), _settings((0.1, 0.5, 1.0)))
    far = [(lod.mesh.positions[:, 0] > 12).sum() for lod in lods]
    assert far[0] > far[1] > 4
    assert far[2] == 0  # the diagonal of 2.8 is less than 4 errors
    assert lods[2].distance_um < 1  # the distance of the remaining bodies


def test_coarser_levels_have_the_values_of_the_finest() -> None:
    fine = ball(4.0, 60)

    def get_texturer(mesh: Mesh, number: NDArray[np.int64]) -> Texturer:
        np.testing.assert_array_equal(fine.positions[number], mesh.positions)
        height = (mesh.positions[:, 2] / 8 + 0.5).astype(np.float32)
        options = UnwrapOptions().resolved(SPACING)
        return Texturer(options, VertexValues(height), lambda: bare(fine), Clock())

    lods = make_levels(
        fine, (), spacing_um=SPACING, lod=LodOptions((0.1, 0.3)), clock=Clock(),
        get_texturer=get_texturer,
    )  # fmt: skip
    for lod in lods:
        assert lod.normal_map is None
        assert lod.baked is not None
        assert lod.baked.reason == "maps were not requested"
        wanted = lod.mesh.positions[:, 2] / 8 + 0.5
        # Vertices have moved by at most the level's error, and values are rounded to a byte.
        np.testing.assert_allclose(lod.baked.openness / 255, wanted, atol=0.3 / 8 + 1 / 255)


def test_the_enclosed_share_is_measured() -> None:
    ball_ = Nearest(ball(4.0, 60), 2000)
    assert measure_enclosure(ball_, Nearest(ball(5.0, 60), 10)) == 1.0
    assert measure_enclosure(ball_, Nearest(ball(3.0, 60), 10)) == 0.0
    assert measure_enclosure(ball_, ball_) == 1.0
    aside = Nearest(moved(ball(4.0, 60), (0.0, 0.0, 1.0)), 10)
    assert measure_enclosure(ball_, aside) == pytest.approx(0.5 - 0.5 / 8, abs=0.02)


@pytest.mark.slow
def test_simplifying_twice_gives_the_same_result(sponge: Mesh) -> None:
    first, second = (list(_chain(sponge)) for _ in range(2))
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a.mesh.triangles, b.mesh.triangles)
        np.testing.assert_array_equal(a.mesh.positions, b.mesh.positions)


@pytest.mark.slow
def test_each_level_records_distances_defects_and_angles(sponge: Mesh) -> None:
    settings = Settings()
    settings = replace(settings, surface=settings.surface.resolved(SPACING))
    lods = _levels(sponge, PLANES, settings)
    for lod in lods:
        quality = lod.quality
        assert quality is not None
        assert quality.faults == 0
        for spread in (quality.away, quality.back):
            assert 0 < spread.mean <= spread.p95 <= spread.max
        assert max(quality.away.p95, quality.back.p95) <= lod.distance_um
        assert 0 < quality.angle_deg < 60


def test_spread_between_concentric_balls_is_the_difference_of_radii() -> None:
    near, far = Nearest(ball(4.0, 60), 2000), Nearest(ball(5.0, 60), 2000)
    for spread in (measure_spread(near, far), measure_spread(far, near)):
        np.testing.assert_allclose([spread.mean, spread.p95, spread.max], 1.0, atol=0.02)


def test_the_largest_distance_includes_vertices_between_samples() -> None:
    spike = ball(5.0, 60)
    positions = spike.positions.copy()
    positions[int(positions[:, 2].argmax())] = [0, 0, 7]
    found = measure_spread(Nearest(replace(spike, positions=positions), 50), Nearest(spike, 50))
    assert found.max == pytest.approx(2.0, abs=0.01)


def test_angle_of_equilateral_triangles_is_60_degrees() -> None:
    assert sharpest_angle(to_mesh(pv.Tetrahedron())) == pytest.approx(60, abs=1e-3)


def _levels(fine: Mesh, planes: tuple[Plane, ...], settings: Settings) -> tuple[Lod, ...]:
    return make_levels(
        fine,
        planes,
        spacing_um=SPACING,
        lod=settings.lod,
        clock=Clock(),
    )
