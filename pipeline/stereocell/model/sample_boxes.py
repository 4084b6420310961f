"""Choose evenly spaced blocks of a region that has too many voxels to count all of them."""

import numpy as np

from stereocell.model.tiling import Box

SAMPLE_EDGE = (16, 128, 128)  # voxels (z, y, x) of a block, if not all of a region is counted


def sample_boxes(region: Box, limit: int, largest: tuple[int, int, int] = SAMPLE_EDGE) -> list[Box]:
    """Return boxes of a region with at most about `limit` voxels: the whole region, or some blocks.

    Blocks are spaced evenly along each axis, from end to end, as many as the limit allows.

    largest  voxels (z, y, x) of a block
    """
    shape = region.shape
    if np.prod(shape, dtype=np.int64) <= limit:
        return [region]
    edge = [min(n, e) for n, e in zip(shape, largest, strict=True)]
    room = [n / e for n, e in zip(shape, edge, strict=True)]
    wanted = limit / float(np.prod(edge, dtype=np.int64))
    share = min(1.0, (wanted / float(np.prod(room))) ** (1 / 3))
    counts = [max(1, int(r * share)) for r in room]
    starts = [
        np.rint(a + (np.arange(count) + 0.5) * n / count - e / 2).astype(int)
        for a, n, e, count in zip(region.start, shape, edge, counts, strict=True)
    ]
    return [
        Box((z, y, x), (z + edge[0], y + edge[1], x + edge[2]))
        for z in map(int, starts[0])
        for y in map(int, starts[1])
        for x in map(int, starts[2])
    ]
