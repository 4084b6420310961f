"""Neighbours are likely of one class: a Potts prior, solved by mean field.

Zhang, Brady & Smith, IEEE Trans. Medical Imaging 20 (2001), with the mean-field update of Van
Leemput et al. (1999) instead of iterated modes, so that probabilities stay probabilities.
"""

import numpy as np
from numpy.typing import NDArray


def apply_potts_prior(
    log_likelihood: NDArray[np.float32],
    mask: NDArray[np.bool_],
    *,
    spacing_um: tuple[float, float, float],
    strength: float,
    rounds: int,
) -> NDArray[np.float32]:
    """Return probabilities float32 (k, z, y, x), summing to 1 in the mask and 0 outside.

    `log_likelihood` float32 (k, z, y, x) holds the classes' shares, too. A neighbour (of six)
    counts by its nearness, one at the finest spacing fully: anisotropic voxels are tied less along
    the coarse axis.
    """
    nearest = min(spacing_um)
    probabilities = np.zeros_like(log_likelihood)
    for done in range(rounds + 1):
        votes = np.zeros_like(log_likelihood)
        if done:
            for axis, spacing in enumerate(spacing_um, start=1):
                weight = np.float32(strength * (nearest / spacing) ** 2)
                ahead = tuple(slice(1, None) if a == axis else slice(None) for a in range(4))
                behind = tuple(slice(None, -1) if a == axis else slice(None) for a in range(4))
                votes[ahead] += weight * probabilities[behind]
                votes[behind] += weight * probabilities[ahead]
        votes += log_likelihood
        votes -= votes.max(axis=0)
        np.exp(votes, out=votes)
        votes /= votes.sum(axis=0)
        votes *= mask
        probabilities = votes
    return probabilities
