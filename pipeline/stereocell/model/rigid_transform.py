"""Where a specimen stands in the world: a rigid move of the whole, or none."""

from collections.abc import Sequence

Matrix = tuple[tuple[float, ...], ...]  # 4 rows of 4, for columns: the offset is the last column
IDENTITY: Matrix = tuple(tuple(float(i == j) for j in range(4)) for i in range(4))


def to_matrix(rows: Sequence[Sequence[float]]) -> Matrix:
    """Return rows of numbers, as a file holds them, as a matrix."""
    return tuple(tuple(float(value) for value in row) for row in rows)
