"""Extents of objects, found block by block, compared with a search for each label by itself."""

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.objects.extents import Runs, find_extents, merge_extents

LARGE = (1 << 63) + 5


def labels_of(dtype: str) -> NDArray[np.integer]:
    rng = np.random.default_rng(2)
    values = np.array([0, 0, 0, 1, 7, 200, LARGE if dtype == "uint64" else 90], dtype)
    return values[rng.integers(0, len(values), (9, 12, 14))]


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "uint32", "uint64"])
def test_merged_extents_of_blocks_are_those_of_the_whole(dtype: str) -> None:
    labels = labels_of(dtype)
    blocks = [(slice(a, b), slice(c, d)) for a, b in ((0, 4), (4, 9)) for c, d in ((0, 5), (5, 12))]
    found = merge_extents([find_extents(labels[z, y], (z.start, y.start, 0)) for z, y in blocks])
    assert found.labels.tolist() == sorted(set(labels.ravel().tolist()) - {0})
    for row, label in enumerate(found.labels):
        at = np.argwhere(labels == label)
        assert found.voxels[row] == len(at)
        assert found.low[row].tolist() == at.min(axis=0).tolist()
        assert found.high[row].tolist() == (at.max(axis=0) + 1).tolist()
        np.testing.assert_allclose(found.centroids[row], at.mean(axis=0))


def test_an_empty_block_has_no_extents() -> None:
    empty = find_extents(np.zeros((2, 3, 4), np.uint8), (0, 0, 0))
    assert len(empty.labels) == len(merge_extents([empty, empty]).labels) == 0
    assert merge_extents([]).low.shape == (0, 3)


def test_runs_end_at_the_end_of_their_row() -> None:
    labels = np.ones((1, 2, 5), np.uint8)
    labels[0, 1, 2:] = 2
    runs = Runs.of(labels)
    assert (runs.values.tolist(), runs.lengths.tolist()) == ([1, 1, 2], [5, 2, 3])
    spread = runs.spread(runs.values.astype(np.int32)).reshape(labels.shape)
    np.testing.assert_array_equal(spread, labels)
