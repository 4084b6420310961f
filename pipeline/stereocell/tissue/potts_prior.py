"""A Potts prior, solved by mean field: neighbouring voxels are likely to have the same class.

It is the model of Zhang, Brady & Smith. The mean-field update of Van Leemput et al. replaces
iterated modes, so that probabilities stay probabilities.

References
Y. Zhang, M. Brady & S. Smith, "Segmentation of brain MR images through a hidden Markov random field
model and the expectation-maximization algorithm", IEEE Trans. Medical Imaging 20, 2001.
doi:10.1109/42.906424
K. Van Leemput, F. Maes, D. Vandermeulen & P. Suetens, "Automated model-based tissue classification
of MR images of the brain", IEEE Trans. Medical Imaging 18, 1999. doi:10.1109/42.811270
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.model.spacing import Spacing


def apply_potts_prior(
    log_likelihood: NDArray[np.float32],
    mask: NDArray[np.bool_],
    *,
    spacing_um: Spacing,
    strength: float,
    rounds: int,
) -> NDArray[np.float32]:
    """Return probabilities, float32 (k, z, y, x), with a sum of 1 in the mask and 0 outside.

    log_likelihood  float32 (k, z, y, x), with the logs of the classes' shares
    mask            bool (z, y, x)
    spacing_um      (z, y, x)
    strength        weight of a neighbour (of six) at the finest spacing; weights fall with the
                    squared spacing, so that neighbours along a coarse axis count less
    rounds          number of updates of the mean field
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
