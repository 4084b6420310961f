"""Connected components of numbered things, by links between pairs of numbers.

For each number, `parent` holds a lower number of the same component, or the number itself if it is
the first of its component. Label maps of voxels are made by cc3d instead.
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel, part

Ints = NDArray[np.int32]


@part
def find_first_of(parent: Ints, number: int) -> int:
    """Return the first number of the component, and shorten the path to it."""
    while parent[number] != number:
        parent[number] = parent[parent[number]]
        number = parent[number]
    return number


@part
def link(parent: Ints, a: int, b: int) -> None:
    """Join the components of two numbers."""
    a, b = find_first_of(parent, a), find_first_of(parent, b)
    if a < b:
        parent[b] = a
    elif b < a:
        parent[a] = b


@part
def number_components(parent: Ints) -> tuple[Ints, int]:
    """Return the component of each number, int32 (n,), ordered by first numbers, and the count."""
    labels, count = np.empty(len(parent), np.int32), 0
    for number in range(len(parent)):
        first = find_first_of(parent, number)
        if first == number:
            labels[number] = count
            count += 1
        else:
            labels[number] = labels[first]
    return labels, count


@kernel
def label_pairs(one: NDArray[np.int64], two: NDArray[np.int64], size: int) -> tuple[Ints, int]:
    """Return the component of each of `size` numbers, given linked pairs, and the count."""
    parent = np.arange(size).astype(np.int32)
    for i in range(len(one)):
        link(parent, one[i], two[i])
    return number_components(parent)
