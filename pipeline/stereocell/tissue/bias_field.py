"""A multiplicative bias field, as caused by a receive coil: a low polynomial of log intensity.

The field is fitted between two steps of the mixture to the part that the classes do not explain.
The weight of each voxel is its certainty: the EM of Wells et al., with the polynomial basis of Van
Leemput et al.

References
W. M. Wells, W. E. L. Grimson, R. Kikinis & F. A. Jolesz, "Adaptive segmentation of MRI data", IEEE
Trans. Medical Imaging 15, 1996. doi:10.1109/42.511747
K. Van Leemput, F. Maes, D. Vandermeulen & P. Suetens, "Automated model-based bias field correction
of MR images of the brain", IEEE Trans. Medical Imaging 18, 1999. doi:10.1109/42.811268
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class BiasField:
    """The logarithm of the field, as a sum of Legendre products over a box of voxels.

    shape    (z, y, x), voxels
    terms    degrees (z, y, x) of each product
    weights  weight of each product, in log intensity
    """

    shape: tuple[int, int, int]
    terms: tuple[tuple[int, int, int], ...]
    weights: tuple[float, ...]

    def log_at(self, indices: NDArray[np.int64]) -> NDArray[np.float32]:
        """Return the logarithm of the field at voxels, float32 (n,).

        indices  int64 (3, n), rows (z, y, x)
        """
        if not self.terms:
            return np.zeros(indices.shape[1], np.float32)
        basis = _basis(indices, self.shape, self.terms)
        return np.asarray(basis @ np.array(self.weights), np.float32)

    def whole(self) -> NDArray[np.float32]:
        """Return the field, a factor of intensity, float32 (z, y, x)."""
        degree = max((max(term) for term in self.terms), default=0)
        axes = [legendre.legvander(_scaled(np.arange(n), n), degree) for n in self.shape]
        cube = np.zeros((degree + 1,) * 3)
        for term, weight in zip(self.terms, self.weights, strict=True):
            cube[term] = weight
        plane = np.einsum("abc,xc->abx", cube, axes[2])
        plane = np.einsum("abx,yb->ayx", plane, axes[1]).astype(np.float32)
        depth = axes[0].astype(np.float32)
        return np.asarray(np.exp(np.tensordot(depth, plane, axes=(1, 0))), np.float32)


def flat_field(shape: tuple[int, int, int], degree: int) -> BiasField:
    """Return the field that is 1 everywhere, with all terms up to a total degree but no constant.

    shape  (z, y, x), voxels
    """
    terms = [t for t in product(range(degree + 1), repeat=3) if 0 < sum(t) <= degree]
    z, y, x = shape
    ordered = tuple((a, b, c) for a, b, c in sorted(terms, key=lambda t: (sum(t), t)))
    return BiasField((z, y, x), ordered, (0.0,) * len(ordered))


def fit_bias_field(
    field: BiasField,
    indices: NDArray[np.int64],
    *,
    residual: NDArray[np.float32],
    weights: NDArray[np.float32],
) -> BiasField:
    """Return the bias field whose logarithm is nearest to the residual.

    indices   int64 (3, n), rows (z, y, x)
    residual  float32 (n,), log intensity that the classes do not explain
    weights   float32 (n,), certainty of each voxel

    A constant is fitted too and dropped, because it is the brightness of the classes.
    """
    basis = _basis(indices, field.shape, field.terms)
    basis = np.concatenate([np.ones((len(basis), 1)), basis], axis=1)
    weighted = basis * weights[:, None]
    normal = weighted.T @ basis
    # Slight damping keeps terms small that the mask does not distinguish.
    normal += 1e-6 * np.trace(normal) / len(normal) * np.eye(len(normal))
    found = np.linalg.solve(normal, weighted.T @ residual)
    return BiasField(field.shape, field.terms, tuple(float(w) for w in found[1:]))


def _scaled(index: NDArray[np.int64], n: int) -> NDArray[np.float64]:
    return 2 * index / max(1, n - 1) - 1


def _basis(
    indices: NDArray[np.int64],
    shape: tuple[int, int, int],
    terms: tuple[tuple[int, int, int], ...],
) -> NDArray[np.float64]:
    degree = max((max(term) for term in terms), default=0)
    z, y, x = (
        legendre.legvander(_scaled(i, n), degree) for i, n in zip(indices, shape, strict=True)
    )
    return np.stack([z[:, a] * y[:, b] * x[:, c] for a, b, c in terms], axis=1)
