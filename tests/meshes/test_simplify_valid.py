"""Simplification that stays valid, where simplification alone makes walls cross."""

import numpy as np
import pytest
from scipy import ndimage

from stereocell.isosurface.extract import extract_surface
from stereocell.meshes.simplify import simplify
from stereocell.meshes.simplify_valid import simplify_without_defects
from stereocell.meshes.validity import find_defects
from stereocell.model.lattice import Lattice
from stereocell.model.mesh import Mesh
from stereocell.model.tiling import Box
from support.meshes import ball, kinds, turned

SHAPE = (32, 32, 32)


def sponge(seed: int) -> Mesh:
    """Smoothed noise: handles, thin walls and bodies side by side."""
    field = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=SHAPE), 1.6)
    distance = np.clip(field / field.std() - 0.3, -2, 2).astype(np.float32)
    whole = Box((0, 0, 0), SHAPE)
    return extract_surface(distance, Lattice.of_whole(whole, (1.0,) * 3))


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "max_error_um"), [(0, 0.8), (1, 2.0), (2, 4.0)])
def test_crossings_that_simplification_makes_are_mended(seed: int, max_error_um: float) -> None:
    fine = sponge(seed)
    assert "crossings" in kinds(find_defects(simplify(fine, max_error_um)))
    done = simplify_without_defects(fine, (), max_error_um=max_error_um)
    assert kinds(find_defects(done.mesh)) == set()
    assert done.simplified_again > 0
    assert done.fallbacks == 0
    assert len(done.mesh.triangles) < 0.5 * len(fine.triangles)


def test_each_vertex_has_its_number_in_the_given_mesh() -> None:
    fine = sponge(0)
    done = simplify_without_defects(fine, (), max_error_um=0.5)
    np.testing.assert_array_equal(fine.positions[done.vertices], done.mesh.positions)


def test_body_that_is_inside_out_is_given_up() -> None:
    done = simplify_without_defects(turned(ball()), (), max_error_um=0.5)
    assert done.fallbacks == 1
    np.testing.assert_array_equal(done.mesh.triangles, turned(ball()).triangles)


def test_simplified_ball_is_one_body_and_says_so() -> None:
    done = simplify_without_defects(ball(), (), max_error_um=0.5)
    assert (done.simplified_again, done.fallbacks) == (0, 0)
    assert len(done.mesh.triangles) < 0.3 * len(ball().triangles)


@pytest.mark.slow
@pytest.mark.parametrize("error_um", [0.5, 1.5])
def test_one_frayed_body_of_many_crossings_is_sound_as_a_whole(error_um: float) -> None:
    """Later tries look only at what is new in them: nothing may be missed by that."""
    field = np.random.default_rng(5).normal(size=(28, 28, 28)).astype(np.float32)
    field = ndimage.gaussian_filter(field, 0.6)
    mesh = extract_surface(field, Lattice.of_whole(Box((0, 0, 0), field.shape), (1.0, 1.0, 1.0)))
    found = simplify_without_defects(mesh, (), max_error_um=error_um)
    assert found.simplified_again > 0
    assert not find_defects(found.mesh).total
