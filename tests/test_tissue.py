"""Tissue classes against the head phantom's truth."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from skimage.filters import threshold_multiotsu

from stereocell.errors import SourceError
from stereocell.samples.head import HeadPhantom, make_head
from stereocell.tissue import Tissue, TissueOptions, learn_tissue

THREE = TissueOptions(classes=3, brain=True)


def dice(found: NDArray[Any], truth: NDArray[Any]) -> float:
    return float(2 * (found & truth).sum() / (found.sum() + truth.sum()))


@pytest.fixture(scope="module", params=[1, 2, 3])
def learned(request: pytest.FixtureRequest) -> tuple[HeadPhantom, Tissue]:
    head = make_head(noise=0.05, bias=0.4, seed=request.param)
    return head, learn_tissue(head.voxels, head.spacing_um, THREE)


def test_each_class_overlaps_the_truth_and_beats_multi_otsu(
    learned: tuple[HeadPhantom, Tissue],
) -> None:
    head, tissue = learned
    labels = np.where(tissue.mask, tissue.probabilities.argmax(axis=0) + 1, 0)
    otsu = np.digitize(head.voxels, threshold_multiotsu(head.voxels, 4))
    for k in (1, 2, 3):
        ours = dice(labels == k, head.labels == k)
        assert ours >= 0.9
        assert ours > dice(otsu == k, head.labels == k)


def test_probabilities_sum_to_one_in_the_mask_and_to_nothing_outside(
    learned: tuple[HeadPhantom, Tissue],
) -> None:
    tissue = learned[1]
    total = tissue.probabilities.sum(axis=0)
    np.testing.assert_allclose(total[tissue.mask], 1, atol=1e-5)
    assert not total[~tissue.mask].any()


def test_the_bias_field_found_leaves_a_third_of_it_at_most(
    learned: tuple[HeadPhantom, Tissue],
) -> None:
    head, tissue = learned
    where = np.argwhere(tissue.mask)
    box = tuple(slice(a, b + 1) for a, b in zip(where.min(axis=0), where.max(axis=0), strict=True))
    inside, truth = tissue.mask[box], np.log(head.bias[box])
    left = truth - np.log(tissue.bias.whole())
    assert left[inside].std() < truth[inside].std() / 3


def test_a_constant_volume_has_no_tissue() -> None:
    with pytest.raises(SourceError, match="every voxel is 7"):
        learn_tissue(np.full((8, 8, 8), 7, np.uint8), (1.0, 1.0, 1.0), THREE)
