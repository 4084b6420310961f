"""Pose of a specimen in the world: a rigid transform of the whole, or none."""

from collections.abc import Sequence

Matrix = tuple[tuple[float, ...], ...]  # 4 rows of 4, for column vectors: the offset comes last
IDENTITY: Matrix = tuple(tuple(float(i == j) for j in range(4)) for i in range(4))


def to_matrix(rows: Sequence[Sequence[float]]) -> Matrix:
    """Return rows of numbers, as a file holds them, as a matrix of floats."""
    return tuple(tuple(float(value) for value in row) for row in rows)
