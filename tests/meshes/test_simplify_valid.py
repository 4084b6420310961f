"""Simplified meshes stay valid, where simplification alone makes walls cross."""

import numpy as np
import pytest
from scipy import ndimage

from stereocell.isosurface.extract import extract_surface
from stereocell.meshes import simplify_valid
from stereocell.meshes.simplify import simplify
from stereocell.meshes.simplify_valid import Simplifier, simplify_without_defects
from stereocell.meshes.validity import find_defects, label_components
from stereocell.model.lattice import Lattice
from stereocell.model.mesh import Mesh
from stereocell.model.tiling import Box
from support.meshes import ball, crowd, joined, kinds, moved, turned

SHAPE = (32, 32, 32)


def sponge(seed: int) -> Mesh:
    """Return the surface of smoothed noise: handles, thin walls and bodies side by side."""
    field = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=SHAPE), 1.6)
    distance = np.clip(field / field.std() - 0.3, -2, 2).astype(np.float32)
    whole = Box((0, 0, 0), SHAPE)
    return extract_surface(distance, Lattice.of_whole(whole, (1.0,) * 3))


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "max_error_um"), [(0, 0.8), (1, 2.0), (2, 4.0)])
def test_crossings_that_simplification_causes_are_repaired(seed: int, max_error_um: float) -> None:
    fine = sponge(seed)
    assert "crossings" in kinds(find_defects(simplify(fine, max_error_um)))
    done = simplify_without_defects(fine, (), max_error_um=max_error_um)
    assert kinds(find_defects(done.mesh)) == set()
    assert done.simplified_again > 0
    assert done.fallbacks == 0
    assert len(done.mesh.triangles) < 0.5 * len(fine.triangles)


def test_each_vertex_has_its_index_in_the_given_mesh() -> None:
    fine = sponge(0)
    done = simplify_without_defects(fine, (), max_error_um=0.5)
    np.testing.assert_array_equal(fine.positions[done.vertices], done.mesh.positions)


def test_a_body_that_is_inside_out_keeps_its_surface() -> None:
    done = simplify_without_defects(turned(ball()), (), max_error_um=0.5)
    assert done.fallbacks == 1
    np.testing.assert_array_equal(done.mesh.triangles, turned(ball()).triangles)


def test_given_bodies_that_cross_keep_their_surface_at_once() -> None:
    """Growing balls of locked vertices around each of so many crossings would take minutes."""
    fine = joined(crowd(), moved(ball(5.0, 60), (14.0, 0.0, 0.0)), moved(ball(), (40.0, 0.0, 0.0)))
    assert len(find_defects(fine).crossings) > 500
    done = simplify_without_defects(fine, (), max_error_um=0.5)
    assert done.fallbacks > 1
    is_far = done.mesh.positions[:, 0] > 30
    alone = simplify_without_defects(moved(ball(), (40.0, 0.0, 0.0)), (), max_error_um=0.5)
    count = is_far[done.mesh.triangles[:, 0]].sum()
    assert count == pytest.approx(len(alone.mesh.triangles), rel=0.05)  # up to rounding


def test_a_simplified_ball_is_counted_as_one_body_without_defects() -> None:
    done = simplify_without_defects(ball(), (), max_error_um=0.5)
    assert (done.simplified_again, done.fallbacks) == (0, 0)
    assert len(done.mesh.triangles) < 0.3 * len(ball().triangles)


@pytest.mark.slow
@pytest.mark.parametrize("error_um", [0.5, 1.5])
def test_one_noisy_body_with_many_crossings_is_valid_as_a_whole(error_um: float) -> None:
    """Later tries check only changed triangles, and must not miss any defect by that."""
    field = np.random.default_rng(5).normal(size=(28, 28, 28)).astype(np.float32)
    field = ndimage.gaussian_filter(field, 0.6)
    mesh = extract_surface(field, Lattice.of_whole(Box((0, 0, 0), field.shape), (1.0, 1.0, 1.0)))
    found = simplify_without_defects(mesh, (), max_error_um=error_um)
    assert found.simplified_again > 0
    assert not find_defects(found.mesh).total


@pytest.mark.slow
def test_the_error_is_halved_if_very_many_vertices_cross(monkeypatch: pytest.MonkeyPatch) -> None:
    """Locks would cover nearly all of the body round by round, and leave it unsimplified."""
    fine = sponge(2)
    monkeypatch.setattr(simplify_valid, "COSTLY", 10)
    many = simplify_without_defects(fine, (), max_error_um=4.0)
    half = simplify(fine, 2.0), simplify(fine, 0.5)
    assert kinds(find_defects(many.mesh)) == set()
    assert many.fallbacks == 0
    assert len(half[0].triangles) < len(many.mesh.triangles) < 1.1 * len(half[1].triangles)
    monkeypatch.setattr(simplify_valid, "HALVINGS", 0)
    at_once = simplify_without_defects(fine, (), max_error_um=4.0)
    assert at_once.fallbacks > 0
    assert kinds(find_defects(at_once.mesh)) == set()


def test_some_bodies_are_simplified_by_another_error_and_the_others_stay() -> None:
    fine = joined(crowd(), moved(ball(5.0, 60), (40.0, 0.0, 0.0)))
    simplifier = Simplifier(fine, ())
    first = simplifier.simplify(0.6)
    assert first.changed.all()
    chosen = np.zeros(label_components(fine.triangles, len(fine.positions)).max() + 1, bool)
    chosen[-1] = True
    second = simplifier.simplify(0.1, chosen)
    by_itself = moved(ball(5.0, 60), (40.0, 0.0, 0.0))
    alone = simplify_without_defects(by_itself, (), max_error_um=0.1)
    was, now = (each.mesh.triangles[:, 0] for each in (first, second))
    is_second = [each.mesh.positions[:, 0] > 30 for each in (first, second)]
    assert second.changed[is_second[1]].all()
    assert not second.changed[~is_second[1]].any()
    count = is_second[1][now].sum()
    assert count == pytest.approx(len(alone.mesh.triangles), rel=0.05)  # up to rounding
    assert count > 2 * is_second[0][was].sum()
    others = [
        each.vertices[each.mesh.triangles[~some[each.mesh.triangles[:, 0]]]]
        for each, some in zip((first, second), is_second, strict=True)
    ]
    np.testing.assert_array_equal(*others)
    assert kinds(find_defects(second.mesh)) == set()


def test_given_bodies_that_cross_keep_their_surface_with_every_error() -> None:
    fine = joined(ball(5.0, 60), moved(ball(5.0, 60), (6.0, 0.0, 0.0)))
    simplifier = Simplifier(fine, ())
    assert simplifier.simplify(0.6).fallbacks == 2
    for error in (0.3, 0.002, 0.0):
        again = simplifier.simplify(error, np.array([True, True]))
        assert again.fallbacks == 2
        np.testing.assert_array_equal(again.mesh.triangles, fine.triangles)
