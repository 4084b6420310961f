"""Label maps are changed so that the surfaces of objects have no pinches."""

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.kernels.critical import find_critical
from stereocell.kernels.half_edges import CROWDED, count_fans, match_twins
from stereocell.objects.interfaces import _faces
from stereocell.objects.well_composed import make_well_composed


def has_pinches(labels: NDArray[np.int32]) -> bool:
    """Return whether the faces between an object's voxels and others form no 2-manifold."""
    _, quads, sides = _faces(labels)
    for number in range(1, int(labels.max()) + 1):
        own = np.concatenate([quads[sides[:, 0] == number], quads[sides[:, 1] == number][:, ::-1]])
        used, corners = np.unique(own, return_inverse=True)
        corners = corners.reshape(-1, 4)
        triangles = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]]).astype(np.int32)
        twins = match_twins(triangles, len(used))
        if (twins == CROWDED).any() or (count_fans(triangles, twins, len(used))[1] < 0).any():
            return True
    return False


@pytest.mark.parametrize("seed", range(40))
def test_a_place_is_found_exactly_where_a_surface_is_pinched(seed: int) -> None:
    rng = np.random.default_rng(seed)
    labels = np.zeros((6, 6, 6), np.int32)
    labels[2:4, 2:4, 2:4] = rng.choice([0, 1, 2], (2, 2, 2), p=[0.4, 0.4, 0.2])
    assert (find_critical(labels, 100)[1] > 0) == has_pinches(labels)


def test_all_cubes_of_one_label_are_judged_correctly() -> None:
    """There are 256 cubes of 2 x 2 x 2 voxels, inside or outside."""
    for bits in range(256):
        cube = (bits >> np.arange(8) & 1).reshape(2, 2, 2).astype(np.int32)
        labels = np.zeros((6, 6, 6), np.int32)
        labels[2:4, 2:4, 2:4] = cube
        assert (find_critical(labels, 100)[1] > 0) == has_pinches(labels), bits


def blobs(shape: tuple[int, int, int], seed: int) -> NDArray[np.int32]:
    """Return touching objects with rough borders."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(4, np.array(shape) - 4, (6, 3))
    grid = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
    away = np.linalg.norm(grid[..., None, :] - places, axis=-1) + rng.normal(0, 0.15, (*shape, 6))
    return np.pad(np.where(away.min(-1) < 7, away.argmin(-1) + 1, 0), 2).astype(np.int32)


@pytest.mark.parametrize("seed", range(3))
def test_changed_objects_have_no_pinch_and_few_voxels_are_changed(seed: int) -> None:
    labels = blobs((30, 30, 30), seed)
    assert has_pinches(labels)
    mended, changed, _ = make_well_composed(labels)
    assert not has_pinches(mended)
    assert 0 < changed == (mended != labels).sum() < 0.01 * (labels > 0).sum()
    again, none, _ = make_well_composed(mended)
    assert none == 0
    np.testing.assert_array_equal(again, mended)


def test_shells_of_one_voxel_are_removed_and_reported() -> None:
    z, y, x = np.mgrid[:24, :24, :24] - 11.5
    radius = np.sqrt(z**2 + y**2 + x**2)
    labels = np.zeros((24, 24, 24), np.int32)
    labels[radius < 9] = 1
    labels[(radius < 9) & (radius > 8.3)] = 2  # full of holes
    labels[2:5, 2:5, 2:5] = 3
    mended, _, thin = make_well_composed(labels)
    assert thin.tolist() == [2]
    assert np.unique(mended).tolist() == [0, 1, 3]
    np.testing.assert_array_equal(mended == 3, labels == 3)
    assert find_critical(mended, 10)[1] == 0


def test_noise_is_recognized_after_few_rounds(monkeypatch: pytest.MonkeyPatch) -> None:
    rounds = []

    def counted(labels: NDArray[np.int32], most: int) -> tuple[NDArray[np.int64], int]:
        rounds.append(most)
        return find_critical(labels, most)

    monkeypatch.setattr("stereocell.objects.well_composed.find_critical", counted)
    noise = np.random.default_rng(0).integers(0, 6, (24, 24, 24))
    mended, changed, thin = make_well_composed(np.pad(noise, 2).astype(np.int32))
    assert (mended.any(), changed, thin.tolist()) == (False, 0, [1, 2, 3, 4, 5])
    assert len(rounds) <= 4
