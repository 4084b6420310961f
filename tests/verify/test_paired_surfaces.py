"""The vertices and triangles of a bundle's surface are paired with those of the stage."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from stereocell.formats.meshopt import reorder
from stereocell.verify.paired_surfaces import Pairs, Surface, pair_surfaces

_STEP = 1e-3  # m, distance between two possible positions of a vertex in the bundle
_LIMIT = _STEP * 3**0.5 / 2


@pytest.fixture(params=[False, True], ids=["plain", "objects"])
def stage(request: pytest.FixtureRequest) -> Surface:
    """Two balls, and a vertex that no triangle uses, with its vertices and triangles shuffled."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    places = np.concatenate([ball.vertices, ball.vertices + 3, [[9.0, 9.0, 9.0]]])
    triangles = np.concatenate([ball.faces, ball.faces + len(ball.vertices)])
    rng = np.random.default_rng(1)
    order = rng.permutation(len(places))
    triangles = rng.permutation(np.argsort(order)[triangles]).astype(np.uint32)
    objects = (places[order, 0] > 1.5).astype(np.int32) if request.param else None
    return Surface(places[order], triangles, objects)


def _written(stage: Surface) -> Surface:
    """Return a surface as the bundle holds it: in the GPU's order, on a lattice, turned."""
    indices, order = reorder(stage.triangles, objects=stage.objects)
    corners = np.roll(indices.reshape(-1, 3), 1, axis=1)
    return Surface(np.rint(stage.places[order] / _STEP) * _STEP, corners.astype(np.int64))


def _shuffled(bundle: Surface) -> Surface:
    rng = np.random.default_rng(2)
    order = rng.permutation(len(bundle.places))
    return Surface(bundle.places[order], rng.permutation(np.argsort(order)[bundle.triangles]))


def _corners(surface: Surface, triangles: NDArray[Any]) -> NDArray[np.float64]:
    return surface.places[triangles].mean(axis=1)


def _assert_same(pairs: Pairs, stage: Surface, bundle: Surface) -> None:
    assert pairs.apart <= _LIMIT
    apart = stage.places[pairs.vertices] - bundle.places[pairs.twins]
    assert np.linalg.norm(apart, axis=1).max() <= _LIMIT
    apart = _corners(stage, pairs.triangles) - _corners(bundle, pairs.twin_triangles)
    assert np.linalg.norm(apart, axis=1).max() <= _LIMIT
    assert len(np.unique(np.sort(pairs.triangles, axis=1), axis=0)) == len(stage.triangles)


def test_each_vertex_and_triangle_is_paired_with_its_own_copy(stage: Surface) -> None:
    bundle = _written(stage)
    pairs = pair_surfaces(stage, bundle, _LIMIT)
    _assert_same(pairs, stage, bundle)
    assert len(pairs.vertices) == len(stage.places) - 1  # one vertex is unused


def test_a_bundle_in_another_order_is_paired_by_distance(stage: Surface) -> None:
    bundle = _shuffled(_written(stage))
    _assert_same(pair_surfaces(stage, bundle, _LIMIT), stage, bundle)


@pytest.mark.parametrize("vertex", [0, 400])
def test_a_vertex_that_moved_is_reported_with_its_distance(stage: Surface, vertex: int) -> None:
    bundle = _written(stage)
    places = bundle.places.copy()
    places[vertex] *= 1 + 0.05 / np.linalg.norm(places[vertex])
    found = pair_surfaces(stage, replace(bundle, places=places), _LIMIT).apart
    assert 40 * _STEP < found < 60 * _STEP


def test_a_triangle_that_faces_the_other_way_is_seen(stage: Surface) -> None:
    bundle = _written(stage)
    triangles = bundle.triangles.copy()
    triangles[7] = triangles[7, ::-1]
    pairs = pair_surfaces(stage, replace(bundle, triangles=triangles), _LIMIT)
    ours, theirs = (
        np.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0])
        for at in (stage.places[pairs.triangles], bundle.places[pairs.twin_triangles])
    )
    assert ((ours * theirs).sum(axis=1) < 0).sum() == 1


def test_a_triangle_in_place_of_another_is_seen(stage: Surface) -> None:
    bundle = _written(stage)
    triangles = bundle.triangles.copy()
    triangles[7] = triangles[8]
    pairs = pair_surfaces(stage, replace(bundle, triangles=triangles), _LIMIT)
    assert 5 * _STEP < pairs.apart < 1
