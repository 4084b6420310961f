"""Learn tissue classes from the volume itself: the probabilities of each voxel, without bias field.

A mixture of Gaussians is fitted to intensity and gradient magnitude. The bias field is fitted
between its steps (tissue/bias_field.py), and a spatial prior is applied at the end
(tissue/potts_prior.py). The Bayesian information criterion chooses the number of classes. All
random numbers are seeded and samples follow a rule, so the same voxels give the same bytes.

References
G. Schwarz, "Estimating the dimension of a model", Annals of Statistics 6, 1978.
doi:10.1214/aos/1176344136
C. Hennig, "Methods for merging Gaussian mixture components", Advances in Data Analysis and
Classification 4, 2010. doi:10.1007/s11634-010-0058-3
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from sklearn.cluster import KMeans  # type: ignore[import-untyped]
from sklearn.mixture import GaussianMixture  # type: ignore[import-untyped]

from stereocell.model.spacing import Spacing
from stereocell.tissue.bias_field import BiasField, fit_bias_field, flat_field
from stereocell.tissue.brain_mask import find_brain, find_foreground
from stereocell.tissue.potts_prior import apply_potts_prior

Field = NDArray[np.float32]
AUTO_CLASSES = range(2, 7)  # numbers of classes that `auto` tries
MODE_BINS = 64  # bins of the histogram whose modes are counted
# Largest dip between two modes, as a share of the lower peak; shallower ones do not count
SHALLOWEST_DIP = 0.9
MIN_SHARE = 0.01  # least share of the voxels in a class


@dataclass(frozen=True, slots=True)
class TissueOptions:
    """How tissue classes are learned."""

    classes: int | Literal["auto"] = "auto"
    brain: bool = False  # learn only inside the brain: heads in MR
    bias_degree: int = 3  # degree of the polynomial; 0: no bias field
    bias_rounds: int = 6  # rounds of fitting mixture and bias field
    sample: int = 120_000  # voxels of the mask to which the mixture is fitted
    # Share of the sample, of lowest gradient, that is used; these voxels lie inside one tissue
    calm_share: float = 0.6
    # Voxels; times the gradient, this is the uncertainty of intensity at a border
    blur_voxels: float = 0.5
    smoothing_voxels: float = 0.8  # sigma in finest spacings, for both features
    prior: float = 0.6  # strength of the Potts prior
    prior_rounds: int = 5  # rounds of the Potts prior's mean field


@dataclass(frozen=True, slots=True)
class Tissue:
    """The learned tissue classes, by rising intensity.

    probabilities  float32 (k, z, y, x), 0..1; their sum is 1 in the mask and 0 outside
    mask           bool (z, y, x): where classes were learned
    bias           the bias field
    means          float64 (k, 2): intensity (bias removed) and gradient magnitude per um
    bic            Bayesian information criterion, by number of classes
    """

    probabilities: Field
    mask: NDArray[np.bool_]
    bias: BiasField
    means: NDArray[np.float64]
    bic: dict[int, float]


def learn_tissue(voxels: NDArray[Any], spacing_um: Spacing, *, options: TissueOptions) -> Tissue:
    """Return the tissue classes of a volume.

    voxels      (z, y, x), any number type
    spacing_um  (z, y, x)

    Raises SourceError for a constant volume, and if no brain is found although it is requested.
    """
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
    # A bias field is learned for each number of classes, because the field depends on the classes,
    # and the classes on the field.
    fields = {k: _learn_field(flat, sampled, indices, k, options) for k in counts}
    # Number of voxels around each voxel that smoothing makes dependent on one another
    scale = (4 * np.pi) ** 1.5 * float(np.prod(sigma))
    independent = min(1.0, int(inside.sum()) / len(calm) / max(scale, 1e-9))
    bic, has_modes = {}, {}
    for k, field in fields.items():
        bic[k], has_modes[k] = _score(sampled, field.log_at(indices), k, independent)
    separated = [k for k in counts if has_modes[k]] or list(counts)[:1]
    count = min(separated, key=lambda k: bic[k])
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
    """Return a mixture with one common covariance, started from k-means of intensity.

    No start is random. With a covariance for each class, two classes would share the mean of one
    tissue and divide its gradients.
    """
    edges = np.quantile(samples[:, 0], np.linspace(0, 1, count + 1))
    low, high = np.quantile(samples[:, 0], (0.005, 0.995))
    # Starts by shares may miss a small class, and starts by range may miss a dim pair.
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
    """Return the BIC for a number of classes, and whether each class is a mode of its own.

    It uses only intensity and the calmest voxels: gradients are not Gaussian, and voxels of mixed
    content would become classes. A class without a mode in the histogram only corrects the shape of
    another class (Hennig).

    independent  share of the samples that are independent after smoothing
    """
    calm = samples[:, 1] <= np.quantile(samples[:, 1], 0.5)
    values = samples[calm, :1] / np.exp(log_field[calm])[:, None]
    mixture = _fit(values, count)
    # Mean log-likelihood of the voxels as they were before the bias field was removed
    likelihood = float(mixture.score(values)) - float(log_field[calm].mean())
    n = max(2.0, independent * len(values))
    parameters = 2 * count  # free parameters: means, all shares except one, one variance
    order = np.argsort(mixture.means_[:, 0])
    means, shares = mixture.means_[order, 0], mixture.weights_[order]
    are_modes = _dips(values[:, 0], means) < SHALLOWEST_DIP
    bic = -2 * n * likelihood + parameters * np.log(n)
    return float(bic), bool(are_modes.all() and shares.min() > MIN_SHARE)


def _dips(values: NDArray[Any], means: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the least height of the histogram between two means, over the lower peak's height."""
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
        # 1 / variance of log intensity is (level / noise)^2
        certainty = level**2 / mixture.covariances_[0, 0]
        weights = share @ certainty
        residual = measured - (share * certainty) @ np.log(level) / weights
        field = fit_bias_field(
            field, indices, residual=residual.astype(np.float32), weights=weights.astype(np.float32)
        )
    return field


def _log_likelihood(mixture: GaussianMixture, intensity: Field, blur: Field) -> Field:
    """Return the log of share times density, float32 (k, z, y, x), classes by rising intensity.

    blur  voxel values added to the spread of intensity at a border, where neighbours then decide
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
