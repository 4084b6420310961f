"""Tissue classes, compared with the truth of the head phantom and of volumes of known classes."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage
from skimage.filters import threshold_multiotsu

from stereocell.model.errors import SourceError
from stereocell.samples.head import CSF, GREY, WHITE, HeadPhantom, make_head
from stereocell.tissue import brain_hull
from stereocell.tissue.brain_hull import Hull, _icosphere, fill_hull
from stereocell.tissue.classify import Tissue, TissueOptions, learn_tissue
from stereocell.tissue.potts_prior import apply_potts_prior
from support.exhaustive import sweep
from support.tissue_volumes import Labels, blobs

THREE = TissueOptions(classes=3, brain=True)
SMALL = (80, 72, 72)


def dice(found: NDArray[np.bool_], truth: NDArray[np.bool_]) -> float:
    return float(2 * (found & truth).sum() / (found.sum() + truth.sum()))


def labels_of(tissue: Tissue) -> Labels:
    return np.where(tissue.mask, tissue.probabilities.argmax(axis=0) + 1, 0)


def require_overlap(head: HeadPhantom, tissue: Tissue, least: float) -> None:
    labels = labels_of(tissue)
    otsu = np.digitize(head.voxels, threshold_multiotsu(head.voxels, 4, nbins=128))
    inside = np.zeros(head.voxels.shape, int)
    values = head.voxels[tissue.mask]
    inside[tissue.mask] = 1 + np.digitize(values, threshold_multiotsu(values, 3, nbins=128))
    for k in (CSF, GREY, WHITE):
        truth = head.labels == k
        ours = dice(labels == k, truth)
        assert ours >= least
        assert ours > dice(otsu == k, truth)
        assert ours > dice(inside == k, truth)


@pytest.fixture(scope="module")
def learned() -> tuple[HeadPhantom, Tissue]:
    # Seed, shape and bias differ from those of tests/bench/tissue.py.
    head = make_head(shape=SMALL, noise=0.05, bias=0.5, seed=23)
    return head, learn_tissue(head.voxels, head.spacing_um, options=THREE)


@pytest.mark.slow
def test_each_class_overlaps_the_truth_and_beats_multi_otsu(
    learned: tuple[HeadPhantom, Tissue],
) -> None:
    require_overlap(*learned, 0.9)


@pytest.mark.exhaustive
@pytest.mark.parametrize(
    ("shape", "bias", "noise"),
    # In the second case y is twice as coarse
    [((112, 96, 96), 0.4, 0.08), ((112, 48, 96), 0.6, 0.05)],
)
def test_classes_overlap_the_truth_in_other_shapes_noises_and_biases(
    shape: tuple[int, int, int], bias: float, noise: float
) -> None:
    head = make_head(shape=shape, noise=noise, bias=bias, seed=31)
    require_overlap(head, learn_tissue(head.voxels, head.spacing_um, options=THREE), 0.9)


@pytest.mark.slow
def test_probabilities_sum_to_one_in_the_mask_and_to_zero_outside(
    learned: tuple[HeadPhantom, Tissue],
) -> None:
    tissue = learned[1]
    total = tissue.probabilities.sum(axis=0)
    np.testing.assert_allclose(total[tissue.mask], 1, atol=1e-5)
    assert not total[~tissue.mask].any()


def test_probabilities_are_calibrated(learned: tuple[HeadPhantom, Tissue]) -> None:
    """Among voxels with probability p of a class, about a share p belongs to it.

    The measure is the expected calibration error of Naeini et al., AAAI 2015.
    """
    head, tissue = learned
    brain = tissue.mask & np.isin(head.labels, (CSF, GREY, WHITE))
    for k in (CSF, GREY, WHITE):
        p = tissue.probabilities[k - 1][brain]
        truth = head.labels[brain] == k
        bins = np.digitize(p, (0.1, 0.5, 0.9))
        counts = np.bincount(bins, minlength=4)
        predicted, found = (np.bincount(bins, values, 4) / counts for values in (p, truth))
        assert (np.abs(predicted - found) * counts).sum() / counts.sum() < 0.03
        assert (np.diff(found) > 0).all()


def test_at_most_half_of_the_bias_field_remains(
    learned: tuple[HeadPhantom, Tissue],
) -> None:
    head, tissue = learned
    where = np.argwhere(tissue.mask)
    box = tuple(slice(a, b + 1) for a, b in zip(where.min(axis=0), where.max(axis=0), strict=True))
    inside, truth = tissue.mask[box], np.log(head.bias[box])
    left = truth - np.log(tissue.bias.whole())
    assert left[inside].std() < truth[inside].std() / 2


def test_the_mask_is_the_brain_with_its_fluid_and_without_scalp(
    learned: tuple[HeadPhantom, Tissue],
) -> None:
    head, tissue = learned
    assert dice(tissue.mask, np.isin(head.labels, (CSF, GREY, WHITE))) > 0.95


@pytest.mark.exhaustive
def test_the_same_voxels_give_the_same_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(brain_hull, "ITERATIONS", 60)
    head = make_head(shape=(56, 48, 48), bias=0.4, seed=5)
    first, second = (learn_tissue(head.voxels, head.spacing_um, options=THREE) for _ in range(2))
    assert first.probabilities.tobytes() == second.probabilities.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("count", sweep([2, 3, 4], kept=[3]))
def test_auto_finds_the_number_of_classes(count: int) -> None:
    voxels, labels = blobs(count)
    tissue = learn_tissue(
        voxels, (1000.0, 1000.0, 1000.0), options=TissueOptions(sample=15_000, bias_rounds=4)
    )
    assert len(tissue.means) == count
    np.testing.assert_allclose(tissue.means[:, 0], 200 * np.arange(2, count + 2), rtol=0.12)
    inner = ndimage.binary_erosion(labels > 0, iterations=2)
    assert (labels_of(tissue)[inner] == labels[inner]).mean() > 0.9


def test_neighbours_along_a_coarse_axis_count_less() -> None:
    """Planes of two classes alternate, in noise, so the votes of planes beside them are wrong."""
    rng = np.random.default_rng(0)
    truth = np.zeros((16, 24, 24), int)
    truth[::2] = 1
    seen = truth + rng.normal(0, 0.5, truth.shape)
    likelihood = np.stack([-2 * (seen - k) ** 2 for k in (0, 1)]).astype(np.float32)
    mask = np.ones(truth.shape, np.bool_)
    right = {
        depth: (
            apply_potts_prior(
                likelihood, mask, spacing_um=(depth, 1.0, 1.0), strength=0.6, rounds=5
            )[1]
            > 0.5
        )
        == truth
        for depth in (1.0, 6.0)
    }
    alone = ((seen > 0.5) == truth).mean()
    assert right[6.0].mean() > alone + 0.05
    assert right[6.0].mean() > right[1.0].mean() + 0.05


def test_a_filled_hull_has_its_volume() -> None:
    points, triangles = _icosphere(3)
    ball = Hull(20 * points + 30, triangles)
    filled = fill_hull(ball, (60, 60, 40), spacing_mm=(1.0, 1.0, 1.5))
    # Voxels that the surface crosses count as inside, so the ball grows by half a voxel all round.
    assert filled.sum() * 1.5 == pytest.approx(4 / 3 * np.pi * 20.5**3, rel=0.05)
    assert filled[30, 30, 20]
    assert not filled[30, 30, 36]


def test_a_constant_volume_has_no_tissue() -> None:
    with pytest.raises(SourceError, match="every voxel is 7"):
        learn_tissue(np.full((8, 8, 8), 7, np.uint8), (1.0, 1.0, 1.0), options=THREE)


def test_a_volume_without_a_brain_is_refused() -> None:
    voxels, _ = blobs(3)
    with pytest.raises(SourceError, match="no brain"):
        learn_tissue(voxels, (100.0, 100.0, 100.0), options=THREE)  # 4 mm along each edge
