"""The pose of a specimen in the world, as a rigid transform."""

from collections.abc import Sequence

Matrix = tuple[tuple[float, ...], ...]  # 4 rows of 4, for column vectors; last column: translation
IDENTITY: Matrix = tuple(tuple(float(i == j) for j in range(4)) for i in range(4))


def to_matrix(rows: Sequence[Sequence[float]]) -> Matrix:
    """Return rows of numbers from a file as a matrix of floats."""
    return tuple(tuple(float(value) for value in row) for row in rows)
