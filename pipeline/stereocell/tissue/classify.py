"""Tissue classes, learned from the volume itself: per-voxel probabilities, bias field removed.

Mixture of Gaussians on intensity and gradient magnitude, with the bias field fitted between its
steps (tissue/bias_field.py) and a spatial prior at the end (tissue/potts_prior.py). How many
classes: the Bayesian information criterion, Schwarz, Annals of Statistics 6 (1978). Everything is
seeded and samples are taken by rule: the same voxels give the same bytes.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from sklearn.cluster import KMeans  # type: ignore[import-untyped]
from sklearn.mixture import GaussianMixture  # type: ignore[import-untyped]

from stereocell.tissue.bias_field import BiasField, fit_bias_field, flat_field
from stereocell.tissue.brain_mask import find_brain, find_foreground
from stereocell.tissue.potts_prior import apply_potts_prior

Field = NDArray[np.float32]
AUTO_CLASSES = range(2, 7)
MODE_BINS = 64
SHALLOWEST_DIP = 0.9  # of the lower peak: between two modes the histogram falls below
LEAST_SHARE = 0.01  # of the voxels: less is no tissue


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
    flat = flat_field(shape, options.bias_degree)
    # with each number of classes its own field: one is told from the other by both together
    fields = {k: _learn_field(flat, sampled, indices, k, options) for k in counts}
    scale = (4 * np.pi) ** 1.5 * float(np.prod(sigma))  # voxels that the smoothing ties together
    independent = min(1.0, int(inside.sum()) / len(calm) / max(scale, 1e-9))
    bic, has_modes = {}, {}
    for k, field in fields.items():
        bic[k], has_modes[k] = _score(sampled, field.log_at(indices), k, independent)
    told = [k for k in counts if has_modes[k]] or list(counts)[:1]
    count = min(told, key=lambda k: bic[k])
    field = fields[count]
    corrected = sampled / np.exp(field.log_at(indices))[:, None]
    mixture = _fit(corrected, count)

    gain = field.whole() if options.bias_degree else np.ones(shape, np.float32)
    blur_um = options.blur_voxels * float(spacing.min())
    smooth /= gain
    likelihood = _log_likelihood(mixture, smooth, _gradient(smooth, spacing) * np.float32(blur_um))
    found = apply_potts_prior(
        likelihood,
        inside,
        spacing_um=spacing_um,
        strength=options.prior,
        rounds=options.prior_rounds,
    )
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
    low, high = np.quantile(samples[:, 0], (0.005, 0.995))
    # by shares and by range: a small class is missed by the one, a dim pair by the other
    starts = ((edges[1:] + edges[:-1]) / 2, np.linspace(low, high, count))
    fits = [
        KMeans(count, init=start[:, None], n_init=1, max_iter=50).fit(samples[:, :1])
        for start in starts
    ]
    groups = min(fits, key=lambda fit: float(fit.inertia_))
    others = np.tile(np.median(samples[:, 1:], axis=0), (count, 1))
    start = np.concatenate([groups.cluster_centers_, others], axis=1)
    spread = [_spread(samples[:, 0], groups.labels_), *samples[:, 1:].var(axis=0)]
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


def _score(
    samples: NDArray[Any], log_field: Field, count: int, independent: float
) -> tuple[float, bool]:
    """Return BIC of so many classes, and whether each is a mode of its own.

    Of intensity alone and the calmest voxels: gradients are no Gaussian, and voxels of mixed
    content would be classes. `independent`: the share of the samples that smoothing left so. A
    class without a mode in the histogram only mends the shape of another (Hennig, Advances in Data
    Analysis and Classification 4, 2010).
    """
    calm = samples[:, 1] <= np.quantile(samples[:, 1], 0.5)
    values = samples[calm, :1] / np.exp(log_field[calm])[:, None]
    mixture = _fit(values, count)
    # as a density of the voxels as they were
    likelihood = float(mixture.score(values)) - float(log_field[calm].mean())
    n = max(2.0, independent * len(values))
    parameters = 2 * count  # means, shares but one, one variance
    order = np.argsort(mixture.means_[:, 0])
    means, shares = mixture.means_[order, 0], mixture.weights_[order]
    are_modes = _dips(values[:, 0], means) < SHALLOWEST_DIP
    bic = -2 * n * likelihood + parameters * np.log(n)
    return float(bic), bool(are_modes.all() and shares.min() > LEAST_SHARE)


def _dips(values: NDArray[Any], means: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return, between each two means, the least of the histogram over the lower one's peak."""
    low, high = np.quantile(values, (0.002, 0.998))
    counts, edges = np.histogram(values, MODE_BINS, (float(low), float(high)))
    density = ndimage.gaussian_filter1d(counts.astype(np.float64), 1.5)
    at = np.clip(np.searchsorted(edges, means) - 1, 0, MODE_BINS - 1)
    ends = np.concatenate([[0], (at[1:] + at[:-1]) // 2, [MODE_BINS - 1]])
    peaks = [density[a : b + 1].max() for a, b in pairwise(ends)]
    tops = [a + int(density[a : b + 1].argmax()) for a, b in pairwise(ends)]
    return np.array(
        [
            density[tops[k] : tops[k + 1] + 1].min() / max(min(peaks[k], peaks[k + 1]), 1e-9)
            for k in range(len(means) - 1)
        ]
    )


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
            field, indices, residual=residual.astype(np.float32), weights=weights.astype(np.float32)
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
