"""Change label maps so that each object has a surface without pinches.

The surface between voxels is a 2-manifold exactly where no label touches itself only by an edge or
a corner. At each such place, one voxel is given to the label or taken from it: the voxel whose
neighbours support the change most.

References
L. J. Latecki, "3D well-composed pictures", Graphical Models and Image Processing 59(3), 1997.
doi:10.1006/gmip.1997.0422
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.critical import find_critical

MAX_SHARE = 0.03  # largest share of an object's voxels that may change
MAX_OF_SMALL = 4  # number of voxels that may change in any object, however small
_ROUNDS = 60
_AT_ONCE = 1 << 20  # largest number of places in a round
_AGAIN = 1000  # number of additional neighbours that a voxel needs to change a second time


def make_well_composed(
    labels: NDArray[np.int32],
) -> tuple[NDArray[np.int32], int, NDArray[np.int32]]:
    """Return labels without pinches, the number of changed voxels, and objects that are too thin.

    labels  int32 (z, y, x), 0 outside; two voxels at each end of each axis are 0

    Objects that would change by more than MAX_SHARE, such as shells and threads of one voxel, are
    removed: int32 (n,), rising. Their voxels count as outside, and not as changed.

    >>> labels = np.zeros((7, 7, 7), np.int32)
    >>> labels[2:4, 2:4, 2:4], labels[4, 4, 2:4] = 1, 1
    >>> mended, changed, thin = make_well_composed(labels)
    >>> changed, int((mended != labels).sum()), thin.tolist()
    (2, 2, [])
    """
    labels = np.ascontiguousarray(labels)
    thin = np.zeros(0, np.int32)
    while True:  # each turn leaves out the objects that were too thin in the turn before
        mended, found = _mend(labels)
        if not len(found):
            return mended, int((mended != labels).sum()), thin
        thin = np.union1d(thin, found).astype(np.int32)
        labels = np.where(np.isin(labels, found), 0, labels).astype(np.int32)


def _mend(labels: NDArray[np.int32]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return labels without pinches; or the labels so far, and the objects that are too thin."""
    mended = labels.copy()
    flat, strides = mended.ravel(), np.array([mended[0].size, mended.shape[2], 1])
    offsets = np.stack(np.meshgrid(*[(-1, 0, 1)] * 3, indexing="ij"), -1).reshape(-1, 3)
    around = offsets[np.any(offsets != 0, axis=1)] @ strides
    changed: set[int] = set()
    for _ in range(_ROUNDS):
        places, count = find_critical(mended, _AT_ONCE)
        if not count:
            return mended, np.zeros(0, np.int32)
        touched: set[int] = set()
        for place in places.tolist():
            if touched.isdisjoint(place):  # otherwise its surroundings have changed: next round
                voxel, label = _best_change(flat, place, around, changed)
                flat[voxel] = label
                touched.add(voxel)
                changed.add(voxel)
        # Each round looks for thin objects, and the first ones end the work, because a noisy label
        # map would take many rounds.
        thin = _find_thin(labels, mended)
        if len(thin):
            return mended, thin
    # Objects that still have pinches after the last round count as too thin.
    return mended, np.unique(flat[places[:, 0]]).astype(np.int32)


def _best_change(
    flat: NDArray[np.int32], place: Sequence[int], around: NDArray[np.int64], changed: set[int]
) -> tuple[int, int]:
    """Return the voxel to change at a place from `find_critical`, and its new label."""
    own, others = dict.fromkeys(place[:2]), [voxel for voxel in place[2:] if voxel >= 0]
    label = int(flat[place[0]])
    changes = [(voxel, label) for voxel in others]
    if len(own) == 2:
        changes += [(voxel, int(flat[other])) for voxel in own for other in others]

    def gain(change: tuple[int, int]) -> int:
        voxel, to = change
        beside = flat[voxel + around]
        won = int((beside == to).sum() - (beside == flat[voxel]).sum())
        return won - (_AGAIN if voxel in changed else 0)

    return max(changes, key=gain)


def _find_thin(labels: NDArray[np.int32], mended: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the objects of which more than MAX_SHARE changed (n,)."""
    where = labels != mended
    size = int(labels.max()) + 1
    voxels = np.bincount(labels.ravel(), minlength=size)
    moved = np.bincount(labels[where], minlength=size) + np.bincount(mended[where], minlength=size)
    most = np.maximum(MAX_SHARE * voxels, MAX_OF_SMALL)
    found = np.flatnonzero(moved > most)
    return found[found > 0].astype(np.int32)
