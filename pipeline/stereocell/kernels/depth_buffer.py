"""Find the triangle nearest to the eye at each pixel of an image."""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel


@kernel
def find_visible(
    frames: NDArray[np.float64],
    depth: NDArray[np.float64],
    low: NDArray[np.int64],
    high: NDArray[np.int64],
    nearest: NDArray[np.float64],
    triangle_of: NDArray[np.int64],
    weights_of: NDArray[np.float64],
) -> None:
    """Write the nearest triangle of each pixel, its barycentric weights and its depth.

    frames       (m, 10), for each triangle: corner a (x, y) in pixels; edges a to b and a to c;
                 twice the area; the heights over the edges opposite a, b and c
    depth        (m, 3), depth at each corner; larger is nearer
    low, high    (m, 2), first and last pixel (x, y) near each triangle
    nearest      (height, width), depth; minus infinity where no triangle is visible
    triangle_of  (height, width)
    weights_of   (height, width, 3)
    """
    for triangle in range(len(frames)):
        ax, ay, abx, aby, acx, acy, twice, over_a, over_b, over_c = frames[triangle]
        for row in range(low[triangle, 1], high[triangle, 1] + 1):
            y = row + 0.5 - ay
            for column in range(low[triangle, 0], high[triangle, 0] + 1):
                x = column + 0.5 - ax
                b = (x * acy - y * acx) / twice
                c = (abx * y - aby * x) / twice
                a = 1 - b - c
                # A pixel counts as inside up to 1e-9 pixels beyond an edge.
                if -a * over_a > 1e-9 or -b * over_b > 1e-9 or -c * over_c > 1e-9:
                    continue
                here = depth[triangle, 0] * a + depth[triangle, 1] * b + depth[triangle, 2] * c
                if here > nearest[row, column]:
                    nearest[row, column] = here
                    triangle_of[row, column] = triangle
                    weights_of[row, column, 0] = a
                    weights_of[row, column, 1] = b
                    weights_of[row, column, 2] = c
