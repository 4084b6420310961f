"""Mending checks only what changed: it must find what a check of everything finds."""

from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.isosurface.extract import extract_surface
from stereocell.meshes import simplify_valid
from stereocell.meshes.simplify import compact, renumber
from stereocell.meshes.simplify_valid import simplify_without_defects
from stereocell.meshes.validity import Defects, find_defects
from stereocell.model.lattice import Lattice
from stereocell.model.mesh import Mesh
from stereocell.model.tiling import Box
from support.exhaustive import sweep
from support.meshes import ball, kinds

SHAPE = (32, 32, 32)


def sponge(seed: int) -> Mesh:
    """Smoothed noise: handles, thin walls and bodies side by side."""
    field = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=SHAPE), 1.6)
    distance = np.clip(field / field.std() - 0.3, -2, 2).astype(np.float32)
    whole = Box((0, 0, 0), SHAPE)
    return extract_surface(distance, Lattice.of_whole(whole, (1.0,) * 3))


def by_vertices(defects: Defects, triangles: NDArray, used: NDArray) -> dict[str, set]:
    """Return faults in terms that don't depend on how triangles and vertices are numbered."""
    corners = used[triangles]
    return {
        "crossings": {frozenset(map(tuple, corners[pair].tolist())) for pair in defects.crossings},
        "non_manifold_edges": {tuple(ends) for ends in used[defects.non_manifold_edges].tolist()},
        "non_manifold_vertices": set(used[defects.non_manifold_vertices].tolist()),
        "degenerate": set(map(tuple, corners[defects.degenerate].tolist())),
    }


@pytest.mark.parametrize(
    ("seed", "max_error_um"),
    sweep(product(range(3), [0.5, 2.0, 4.0]), kept=[(0, 0.5), (1, 2.0), (2, 4.0)]),
)
def test_defects_of_every_round_are_those_of_a_full_check(
    monkeypatch: pytest.MonkeyPatch, seed: int, max_error_um: float
) -> None:
    totals = []
    checked = simplify_valid._Draft.defects

    def compared(
        self: simplify_valid._Draft, triangles: NDArray, changed: set[int] | None
    ) -> Defects:
        found = checked(self, triangles, changed)
        used, own = renumber(triangles, len(self.mesh.positions))
        full = find_defects(compact(self.mesh, triangles))
        everything = np.arange(len(self.mesh.positions))
        assert by_vertices(found, triangles, everything) == by_vertices(full, own, used)
        totals.append(full.total)
        return found

    monkeypatch.setattr(simplify_valid._Draft, "defects", compared)
    done = simplify_without_defects(sponge(seed), (), max_error_um=max_error_um)
    assert kinds(find_defects(done.mesh)) == set()
    assert totals[-1] == 0
    assert max_error_um < 2 or len(totals) > 1  # else this would show nothing


def test_triangles_are_found_among_others() -> None:
    rng = np.random.default_rng(0)
    among = np.unique(rng.integers(0, 40, (3000, 3)), axis=0).astype(np.uint32)
    triangles = rng.integers(0, 40, (3000, 3)).astype(np.uint32)
    place = {tuple(row): k for k, row in enumerate(among.tolist())}
    expected = np.array([place.get(tuple(row), -1) for row in triangles.tolist()])
    # of two alike none is known from before
    _, number, count = np.unique(triangles, axis=0, return_inverse=True, return_counts=True)
    expected[count[number.ravel()] > 1] = -1
    assert (expected >= 0).any()
    np.testing.assert_array_equal(simplify_valid._find(triangles, among), expected)
    assert (simplify_valid._find(triangles, among[:0]) == -1).all()


def test_simplified_ball_is_one_body_and_says_so() -> None:
    done = simplify_without_defects(ball(), (), max_error_um=0.5)
    assert (done.simplified_again, done.fallbacks) == (0, 0)
    assert len(done.mesh.triangles) < 0.3 * len(ball().triangles)
