"""Tissue classes, learned from the volume itself: per-voxel probabilities, bias field removed.

Mixture of Gaussians on intensity and gradient magnitude, with the bias field fitted between its
steps (bias_field.py) and a spatial prior at the end (spatial_prior.py). How many classes: the
Bayesian information criterion, Schwarz, Annals of Statistics 6 (1978). Everything is seeded and
samples are taken by rule: the same voxels give the same bytes.
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from sklearn.cluster import KMeans  # type: ignore[import-untyped]
from sklearn.mixture import GaussianMixture  # type: ignore[import-untyped]

from stereocell.bias_field import BiasField, fit_bias_field, flat_field
from stereocell.brain_mask import find_brain, find_foreground
from stereocell.spatial_prior import apply_potts_prior

Field = NDArray[np.float32]
AUTO_CLASSES = range(2, 7)


@dataclass(frozen=True, slots=True)
class TissueOptions:
    classes: int | Literal["auto"] = "auto"
    brain: bool = False  # learn inside the brain alone: heads in MR
    bias_degree: int = 3  # of the polynomial; 0: the field is 1
    bias_rounds: int = 6
    sample: int = 120_000  # voxels of the mask, of which the mixture is fitted to
    calm_share: float = 0.6  # those of the lowest gradient: one tissue, not a border of two
    blur_voxels: float = 0.5  # at a border intensity is uncertain by the gradient over so much
    smoothing_voxels: float = 0.8  # sigma, of the finest spacing, of both features
    prior: float = 0.6
    prior_rounds: int = 5


@dataclass(frozen=True, slots=True)
class Tissue:
    """probabilities  float32 (k, z, y, x), by rising intensity; 1 in sum in the mask, else 0
    mask              bool (z, y, x): where classes were learned
    means             of each class: intensity (bias removed) and gradient magnitude a um, (k, 2)
    bic               of each number of classes that was tried
    """

    probabilities: Field
    mask: NDArray[np.bool_]
    bias: BiasField
    means: NDArray[np.float64]
    bic: dict[int, float]


def learn_tissue(
    voxels: NDArray[Any], spacing_um: tuple[float, float, float], options: TissueOptions
) -> Tissue:
    """Return the classes of `voxels` (z, y, x). Raises SourceError where there are none."""
    spacing = np.asarray(spacing_um)
    raw = voxels.astype(np.float32)
    sigma = options.smoothing_voxels * spacing.min() / spacing
    smooth = ndimage.gaussian_filter(raw, sigma)
    mask = find_foreground(smooth)
    if options.brain:
        mask = find_brain(smooth, mask, spacing_um)
    box = ndimage.find_objects(mask.view(np.int8))[0]
    raw, smooth, inside = raw[box], smooth[box], mask[box]
    places = np.flatnonzero(inside)[:: max(1, int(inside.sum()) // options.sample)]
    shape = (raw.shape[0], raw.shape[1], raw.shape[2])
    indices = np.stack(np.unravel_index(places, shape)).astype(np.int64)
    sampled = np.stack([smooth.ravel()[places], _gradient(smooth, spacing).ravel()[places]], axis=1)

    calm = sampled[:, 1] <= np.quantile(sampled[:, 1], options.calm_share)
    sampled, indices = sampled[calm], indices[:, calm]

    counts = AUTO_CLASSES if options.classes == "auto" else [options.classes]
    field = flat_field(shape, options.bias_degree)
    count, bic = _choose(sampled, counts)
    field = _learn_field(field, sampled, indices, count, options)
    corrected = sampled / np.exp(field.log_at(indices))[:, None]
    if len(counts) > 1:
        count, bic = _choose(corrected, counts)  # a field makes more classes than there are
    mixture = _fit(corrected, count)
    bic[count] = float(mixture.bic(corrected))

    gain = field.whole() if options.bias_degree else np.ones(shape, np.float32)
    blur_um = options.blur_voxels * float(spacing.min())
    smooth /= gain
    likelihood = _log_likelihood(mixture, smooth, _gradient(smooth, spacing) * np.float32(blur_um))
    found = apply_potts_prior(likelihood, inside, spacing_um, options.prior, options.prior_rounds)
    probabilities = np.zeros((count, *voxels.shape), np.float32)
    probabilities[(slice(None), *box)] = found
    order = np.argsort(mixture.means_[:, 0])
    return Tissue(probabilities, mask, field, mixture.means_[order], bic)


def _gradient(field: Field, spacing: NDArray[np.float64]) -> Field:
    total = np.zeros_like(field)
    for axis, h in enumerate(spacing):
        total += np.gradient(field, axis=axis) ** 2 / np.float32(h) ** 2
    return np.sqrt(total, out=total)


def _fit(samples: NDArray[Any], count: int) -> GaussianMixture:
    """Return a mixture of one common covariance, begun at k-means of intensity: no random start.

    With a covariance for each, two classes would share one tissue's mean and part its gradients.
    """
    edges = np.quantile(samples[:, 0], np.linspace(0, 1, count + 1))
    middles = ((edges[1:] + edges[:-1]) / 2)[:, None]
    groups = KMeans(count, init=middles, n_init=1, max_iter=50).fit(samples[:, :1])
    middle = np.full(count, np.median(samples[:, 1]))
    start = np.stack([groups.cluster_centers_[:, 0], middle], axis=1)
    spread = _spread(samples[:, 0], groups.labels_), float(samples[:, 1].var())
    mixture = GaussianMixture(
        count,
        covariance_type="tied",
        means_init=start,
        weights_init=np.bincount(groups.labels_, minlength=count) / len(samples),
        precisions_init=np.diag([1 / max(v, 1e-12) for v in spread]),
        max_iter=200,
        random_state=0,
        reg_covar=1e-12,
    )
    return mixture.fit(samples)


def _spread(values: NDArray[Any], labels: NDArray[Any]) -> float:
    counts = np.maximum(np.bincount(labels), 1)
    means = np.bincount(labels, values) / counts
    return float(np.mean((values - means[labels]) ** 2))


def _choose(samples: NDArray[Any], counts: Any) -> tuple[int, dict[int, float]]:
    bic = {k: float(_fit(samples, k).bic(samples)) for k in counts}
    return min(bic, key=lambda k: bic[k]), bic


def _learn_field(
    field: BiasField,
    samples: NDArray[Any],
    indices: NDArray[np.int64],
    count: int,
    options: TissueOptions,
) -> BiasField:
    if not options.bias_degree:
        return field
    measured = np.log(np.maximum(samples[:, 0], 1e-6 * samples[:, 0].max()))
    for _ in range(options.bias_rounds):
        corrected = samples / np.exp(field.log_at(indices))[:, None]
        mixture = _fit(corrected, count)
        share = mixture.predict_proba(corrected)
        level = np.maximum(mixture.means_[:, 0], 1e-6 * samples[:, 0].max())
        # of log intensity: noise over level
        certainty = level**2 / mixture.covariances_[0, 0]
        weights = share @ certainty
        residual = measured - (share * certainty) @ np.log(level) / weights
        field = fit_bias_field(
            field, indices, residual.astype(np.float32), weights.astype(np.float32)
        )
    return field


def _log_likelihood(mixture: GaussianMixture, intensity: Field, blur: Field) -> Field:
    """Return log of share times density, float32 (k, z, y, x), classes by rising intensity.

    `blur`: what a border adds to the spread of intensity, so that there the neighbours decide.
    """
    order = np.argsort(mixture.means_[:, 0])
    result = np.empty((len(order), *intensity.shape), np.float32)
    added = blur**2
    for place, k in enumerate(order):
        variance = np.float32(mixture.covariances_[0, 0]) + added
        result[place] = -0.5 * (intensity - np.float32(mixture.means_[k, 0])) ** 2 / variance
        result[place] -= 0.5 * np.log(variance)
        result[place] += np.float32(np.log(mixture.weights_[k]))
    return result
