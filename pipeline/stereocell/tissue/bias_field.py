"""A multiplicative bias field, as a receive coil leaves it: a low polynomial of log intensity.

Fitted between two steps of the mixture to what the classes don't explain, voxels weighted by how
sure that is: the EM of Wells, Grimson, Kikinis & Jolesz, IEEE Trans. Medical Imaging 15 (1996),
with the polynomial basis of Van Leemput et al., IEEE Trans. Medical Imaging 18 (1999).
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class BiasField:
    """log of the field as a sum of Legendre products over a box of `shape` (z, y, x) voxels."""

    shape: tuple[int, int, int]
    terms: tuple[tuple[int, int, int], ...]
    weights: tuple[float, ...]

    def log_at(self, indices: NDArray[np.int64]) -> NDArray[np.float32]:
        """Return log of the field at voxels, int (3, n) as (z, y, x); float32 (n,)."""
        if not self.terms:
            return np.zeros(indices.shape[1], np.float32)
        basis = _basis(indices, self.shape, self.terms)
        return np.asarray(basis @ np.array(self.weights), np.float32)

    def whole(self) -> NDArray[np.float32]:
        """Return the field, float32 (z, y, x)."""
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
    """Return the field that is 1 everywhere, of all terms up to a total degree but the constant."""
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
    """Return the field whose log is nearest to `residual` (n,), weighted, at voxels (3, n).

    A constant is fitted along and left out: it is the classes' brightness, not the field's.
    """
    basis = _basis(indices, field.shape, field.terms)
    basis = np.concatenate([np.ones((len(basis), 1)), basis], axis=1)
    weighted = basis * weights[:, None]
    normal = weighted.T @ basis
    # a hair of damping: terms that the mask doesn't tell apart stay small
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
