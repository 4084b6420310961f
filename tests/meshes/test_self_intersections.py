"""Triangles that meet: each kind by hand, and random ones compared with rational arithmetic."""

from fractions import Fraction
from itertools import combinations, product

import numpy as np
import pytest

from stereocell.kernels.crossings import find_spread
from stereocell.meshes import self_intersections
from stereocell.meshes.self_intersections import are_collinear, find_crossings, orient_2d, orient_3d
from support.exhaustive import examples, sweep

CORNER = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
KINDS = {
    "apart": (0, [[5, 5, 5], [6, 5, 5], [5, 6, 5]], [3, 4, 5]),
    "through each other": (1, [[0.2, 0.2, -1], [0.2, 0.2, 1], [0.3, 0.2, 1]], [3, 4, 5]),
    "a corner on the other's face": (1, [[0.2, 0.2, 0], [0.2, 0.2, 1], [0.3, 0.2, 1]], [3, 4, 5]),
    "a corner on the other's edge": (1, [[0.5, 0, 0], [0.5, 0, 1], [0.5, -1, 1]], [3, 4, 5]),
    "corners in one place": (1, [[0, 0, 0], [0, 0, 1], [-1, 0, 1]], [3, 4, 5]),
    "edges that cross": (1, [[0.5, 0, -1], [0.5, 0, 1], [0.5, -1, 0]], [3, 4, 5]),
    "one inside the other": (1, [[0.1, 0.1, 0], [0.2, 0.1, 0], [0.1, 0.2, 0]], [3, 4, 5]),
    "coplanar, overlapping": (1, [[0.1, 0.1, 0], [1.1, 0.1, 0], [0.1, 1.1, 0]], [3, 4, 5]),
    "coplanar, beside": (0, [[1.1, 0.1, 0], [2.1, 0.1, 0], [1.1, 1.1, 0]], [3, 4, 5]),
    "an edge, folded flat": (1, [[0.5, 0.9, 0]], [1, 0, 3]),
    "an edge, folded nearly flat": (0, [[0.5, 0.9, 1e-12]], [1, 0, 3]),
    "an edge, unfolded": (0, [[0.5, -0.9, 0]], [1, 0, 3]),
    "the same triangle, turned over": (1, [], [0, 2, 1]),
    "a corner, through": (1, [[0.3, 0.3, 1], [0.3, 0.3, -1]], [0, 3, 4]),
    "a corner, past": (0, [[-0.3, -0.3, 1], [-0.3, -0.3, -1]], [0, 3, 4]),
    "a corner, coplanar, overlapping": (1, [[0.3, 0.6, 0], [0.6, 0.3, 0]], [0, 3, 4]),
    "a corner, coplanar, around": (1, [[9, -1, 0], [-1, 9, 0]], [0, 3, 4]),
    "a corner, coplanar, across": (0, [[-1, 0, 0], [0, -1, 0]], [0, 3, 4]),
    "a corner, coplanar, edge on edge": (1, [[2, 0, 0], [0, -1, 0]], [0, 3, 4]),
    "a corner, edge on edge": (1, [[2, 0, 0], [0, 0, 1]], [0, 3, 4]),
    "a corner, edge by edge": (0, [[2, 0, 1e-12], [0, 0, 1]], [0, 3, 4]),
}


@pytest.mark.parametrize("kind", KINDS)
def test_pairs_of_each_kind_meet_or_not_in_all_projections(kind: str) -> None:
    expected, more, second = KINDS[kind]
    positions = np.array(CORNER + more, float)
    for axes in ([0, 1, 2], [1, 2, 0], [2, 0, 1]):  # in all three planes of projection
        for turn in range(3):
            triangles = np.array([[0, 1, 2], np.roll(second, turn)], np.int64)
            assert len(find_crossings(positions[:, axes], triangles)) == expected
            assert len(find_crossings(positions[:, axes], triangles[::-1])) == expected


Point = tuple[Fraction, ...]


def _plus(a: Point, b: Point, t: Fraction) -> Point:
    return tuple(x + t * (y - x) for x, y in zip(a, b, strict=True))


def _solve(rows: list[list[Fraction]]) -> list[Fraction] | None:
    """Solve a square system with its right side by Gauss's method; return None if singular."""
    n = len(rows)
    rows = [list(row) for row in rows]
    for k in range(n):
        pivot = next((r for r in range(k, n) if rows[r][k]), None)
        if pivot is None:
            return None
        rows[k], rows[pivot] = rows[pivot], rows[k]
        for r in range(n):
            if r != k:
                factor = rows[r][k] / rows[k][k]
                rows[r] = [x - factor * y for x, y in zip(rows[r], rows[k], strict=True)]
    return [rows[k][n] / rows[k][k] for k in range(n)]


def _common_points(one: list[Point], other: list[Point]) -> set[Point]:
    """Return the corners of the common part of two triangles.

    Rational arithmetic, by brute force over edges and faces, edges and edges, corners and faces.
    """
    found: set[Point] = set()
    for first, second in ((one, other), (other, one)):
        a, b, c = second
        for p, q in combinations(first, 2):
            # p + t (q - p) = a + u (b - a) + v (c - a)
            system = [[q[k] - p[k], a[k] - b[k], a[k] - c[k], a[k] - p[k]] for k in range(3)]
            solved = _solve(system)
            if solved is not None:
                t, u, v = solved
                if 0 <= t <= 1 and u >= 0 and v >= 0 and u + v <= 1:
                    found.add(_plus(p, q, t))
        for point in first:  # corners in the plane of the other triangle
            for i, j in combinations(range(3), 2):
                solved = _solve([[b[k] - a[k], c[k] - a[k], point[k] - a[k]] for k in (i, j)])
                if solved is not None:
                    u, v = solved
                    at = tuple(a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]) for k in range(3))
                    if at == point and u >= 0 and v >= 0 and u + v <= 1:
                        found.add(point)
                    break
    for (p, q), (r, s) in product(combinations(one, 2), combinations(other, 2)):
        for i, j in combinations(range(3), 2):
            solved = _solve([[q[k] - p[k], r[k] - s[k], r[k] - p[k]] for k in (i, j)])
            if solved is not None:
                t, u = solved
                if 0 <= t <= 1 and 0 <= u <= 1 and _plus(p, q, t) == _plus(r, s, u):
                    found.add(_plus(p, q, t))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("shared", sweep([0, 1, 2], kept=[1]))
def test_random_triangles_on_a_coarse_grid_meet_as_in_rational_arithmetic(shared: int) -> None:
    """On 4 x 4 x 3 points most pairs of triangles are special: coplanar, collinear, touching."""
    rng = np.random.default_rng(shared)
    meeting = 0
    for _ in range(200):
        positions = rng.integers(0, [4, 4, 3], (6 - shared, 3)).astype(float)
        triangles = np.array([[0, 1, 2], [0, 1, 2]])
        triangles[1, shared:] = np.arange(3, 6 - shared)
        corners = positions[triangles]
        if are_collinear(*corners.transpose(1, 0, 2)).any():
            continue
        one, other = ([tuple(map(Fraction, p)) for p in t] for t in corners.astype(int).tolist())
        common = _common_points(one, other)
        beside = common - {one[k] for k in range(shared)}
        found = find_crossings(positions, triangles)
        assert len(found) == bool(beside), (positions, beside)
        meeting += bool(beside)
    assert 10 < meeting < 190


def test_signs_are_exact_although_floats_round() -> None:
    """Kettner et al. 2008: for points near a line, naive determinants have wrong signs."""
    a = np.array([[0.5, 0.5]]) + np.arange(64)[:, None] * 2.0**-53
    b, c = np.full((64, 2), 12.0), np.full((64, 2), 24.0)
    assert (orient_2d(a, b, c) == 0).all()
    a[:, 1] += 2.0**-53
    signs = set(orient_2d(a, b, c).tolist())
    assert len(signs) == 1
    assert signs != {0}


@pytest.mark.parametrize("scale", [1.0, 1e-4, 1e6])
@pytest.mark.parametrize("kind", ["anywhere", "on a grid", "nearly in a plane"])
def test_the_side_of_a_plane_is_the_same_as_in_exact_arithmetic(kind: str, scale: float) -> None:
    """Compare with Python's rationals. Floats decide only where their error is small enough."""
    rng = np.random.default_rng(1)
    points = scale * rng.normal(size=(4, 300, 3))
    if kind == "on a grid":
        points = np.round(2 * points / scale) * scale / 2
    if kind == "nearly in a plane":
        weights = rng.dirichlet([1, 1, 1], 300)
        points[3] = np.einsum("nk,knd->nd", weights, points[:3])
    signs = orient_3d(*points)
    assert {"on a grid": {-1, 0, 1}}.get(kind, {-1, 1}) <= set(signs.tolist())
    for found, rows in zip(signs.tolist(), points.transpose(1, 0, 2), strict=True):
        a, b, c, d = ([Fraction(x) for x in row] for row in rows.tolist())
        u, v, w = ([x - y for x, y in zip(p, d, strict=True)] for p in (a, b, c))
        volume = sum(
            u[i] * (v[(i + 1) % 3] * w[(i + 2) % 3] - v[(i + 2) % 3] * w[(i + 1) % 3])
            for i in range(3)
        )
        assert found == (volume > 0) - (volume < 0)


@pytest.mark.parametrize("axes", [[0, 1, 2], [1, 2, 0], [2, 0, 1]])
def test_floats_alone_separate_triangles_of_one_plane(
    axes: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Walls at the end of the volume are like this. Exact tests of all pairs would be slow."""
    asked = []
    monkeypatch.setattr(
        self_intersections, "_apart", lambda at, triangles, pairs: asked.append(pairs) or pairs
    )
    y, x = np.mgrid[:12, :12].reshape(2, -1).astype(float)
    positions = np.stack([x, y, np.full_like(x, 3)], axis=1)[:, axes]
    start = np.flatnonzero((x < 11) & (y < 11))
    triangles = np.concatenate(
        [start[:, None] + [0, 1, 13], start[:, None] + [0, 13, 12]]
    ).astype(np.int64)  # fmt: skip
    assert len(find_crossings(positions, triangles)) == 0
    assert [len(pairs) for pairs in asked] == [0]


@pytest.mark.parametrize("axes", [[0, 1, 2], [1, 2, 0], [2, 0, 1]])
def test_floats_alone_separate_the_triangles_of_a_large_flat_face(
    axes: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """All triangles of a polygon meet at one corner, so exact tests of all pairs would be slow."""
    asked = []
    monkeypatch.setattr(
        self_intersections, "_meet", lambda at, triangles, pairs: asked.append(pairs) or pairs
    )
    angle = np.linspace(0, 2 * np.pi, 500, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), np.full(500, 3.0)], axis=1)
    around = np.arange(1, 499)
    triangles = np.stack([0 * around, around, around + 1], axis=1)
    assert len(find_crossings(ring[:, axes], triangles)) == 0
    assert [len(pairs) for pairs in asked] == [0]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_all_pairs_with_a_fresh_triangle_are_found_and_no_others(seed: int) -> None:
    """A crowd of triangles, some with common corners; each share of them is fresh in turn."""
    rng = np.random.default_rng(seed)
    positions = rng.integers(0, 9, (120, 3)).astype(float)
    triangles = np.array([rng.permutation(120)[:3] for _ in range(250)])
    flat = are_collinear(*positions[triangles].transpose(1, 0, 2))
    triangles = np.ascontiguousarray(triangles[~flat])
    everything = find_crossings(positions, triangles)
    assert len(everything) > 500
    for share in (0.0, 0.02, 0.5, 1.0):
        fresh = rng.random(len(triangles)) < share
        found = find_crossings(positions, triangles, fresh=fresh)
        np.testing.assert_array_equal(found, everything[fresh[everything].any(axis=1)])


def test_few_fresh_triangles_among_many_are_found_in_all_their_pairs() -> None:
    """If few are fresh, only triangles around them are examined, even far across the grid."""
    rng = np.random.default_rng(9)
    centres = rng.random((4000, 1, 3)) * [100, 90, 2]
    positions = (centres + rng.normal(size=(4000, 3, 3))).reshape(-1, 3)
    positions[:3] = [[0, 0, 1], [100, 90, 1], [100, 80, 1]]  # a triangle through the whole crowd
    triangles = np.arange(12_000).reshape(-1, 3)
    everything = find_crossings(positions, triangles)
    fresh = np.zeros(4000, bool)
    fresh[[0, 17, 3999]] = True
    expected = everything[fresh[everything].any(axis=1)]
    assert len(expected) > 50
    np.testing.assert_array_equal(find_crossings(positions, triangles, fresh=fresh), expected)


@pytest.mark.slow
@pytest.mark.parametrize(
    "kind",
    sweep(["a star", "round twice", "anyhow", "in a plane", "on edge"], ["round twice", "on edge"]),
)
def test_triangles_around_a_vertex_give_the_same_pairs_together_and_two_by_two(kind: str) -> None:
    """Together most pairs are skipped; the result must be that of testing each pair alone."""
    rng = np.random.default_rng(len(kind))
    meeting, spread = 0, 0
    tries = examples(150, 30)
    for _ in range(tries):
        count = int(rng.integers(3, 9))
        turns = 2 if kind == "round twice" else 1
        angle = turns * 2 * np.pi * (np.arange(count) + rng.uniform(-0.3, 0.3, count)) / count
        ring = np.stack([np.cos(angle), np.sin(angle), 0.5 * rng.normal(size=count)], axis=1)
        if kind == "anyhow":
            ring = rng.normal(size=(count, 3))
        elif kind == "in a plane":
            ring[:, 2] = 0
            ring = np.round(2 * ring)
            ring[0] *= rng.choice([-1, 1])  # folded back
        elif kind == "on edge":
            ring[:, 1] *= 0.02
        positions = np.concatenate([np.zeros((1, 3)), ring])
        around = np.arange(count)
        triangles = np.stack([0 * around, 1 + around, 1 + (around + 1) % count], axis=1)
        if are_collinear(*positions[triangles].transpose(1, 0, 2)).any():
            continue
        alone = [
            (i, j)
            for i, j in combinations(range(count), 2)
            if len(find_crossings(positions, triangles[[i, j]]))
        ]
        assert find_crossings(positions, triangles).tolist() == [list(pair) for pair in alone]
        meeting += bool(alone)
        is_spread = find_spread(positions, triangles.astype(np.int32))
        assert not is_spread[1:].any()  # vertices of the ring have two triangles each
        spread += bool(is_spread[0])
    assert 150 * meeting >= tries * {"round twice": 100, "anyhow": 40, "in a plane": 5}.get(kind, 0)
    assert 150 * spread >= tries * {"a star": 120, "in a plane": 20}.get(kind, 0)
