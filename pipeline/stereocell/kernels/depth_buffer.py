"""Project a mesh, and find the triangle nearest to the eye at each pixel of an image."""

import math

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel, part


@kernel
def place_points(
    points: NDArray[np.floating],
    centre: NDArray[np.float64],
    axes: NDArray[np.float64],
    scale: float,
    middle: NDArray[np.float64],
    places: NDArray[np.float64],
    depth: NDArray[np.float64],
) -> None:
    """Write where points lie in an image, and how deep; a matrix product would start threads.

    points  (n, 3), float32 or float64, world
    centre  (3,), point in the middle of the image
    axes    (3, 3), columns point right, up, and to the eye in the world
    scale   pixels for each unit of length
    middle  (2,), middle of the image in pixels: x right, y down
    places  (n, 2), pixels: x right, y down
    depth   (n,), larger is nearer
    """
    for n in range(len(points)):
        x = np.float64(points[n, 0]) - centre[0]
        y = np.float64(points[n, 1]) - centre[1]
        z = np.float64(points[n, 2]) - centre[2]
        right = x * axes[0, 0] + y * axes[1, 0] + z * axes[2, 0]
        up = x * axes[0, 1] + y * axes[1, 1] + z * axes[2, 1]
        places[n, 0], places[n, 1] = middle[0] + scale * right, middle[1] - scale * up
        depth[n] = x * axes[0, 2] + y * axes[1, 2] + z * axes[2, 2]


@kernel
def find_visible(
    places: NDArray[np.float64],
    depth: NDArray[np.float64],
    triangles: NDArray[np.uint32],
    number: int,
    nearest: NDArray[np.float64],
    mesh_of: NDArray[np.int32],
    triangle_of: NDArray[np.int32],
) -> None:
    """Write where a mesh is nearer to the eye than all before it: at which triangle, and how deep.

    places       (n, 2), vertices in pixels: x right, y down
    depth        (n,), larger is nearer
    triangles    (m, 3)
    number       number of the mesh
    nearest      (height, width), depth; minus infinity where nothing is visible
    mesh_of      (height, width), number of the visible mesh
    triangle_of  (height, width)
    """
    last_row, last_column = nearest.shape[0] - 1, nearest.shape[1] - 1
    for triangle in range(len(triangles)):
        i, j, k = triangles[triangle]
        (ax, ay), (bx, by), (cx, cy) = places[i], places[j], places[k]
        # Most triangles of a fine surface lie between the centres of pixels.
        left = max(math.ceil(min(ax, bx, cx) - 0.5 - 1e-6), 0)
        right = min(math.floor(max(ax, bx, cx) - 0.5 + 1e-6), last_column)
        if left > right:
            continue
        top = max(math.ceil(min(ay, by, cy) - 0.5 - 1e-6), 0)
        bottom = min(math.floor(max(ay, by, cy) - 0.5 + 1e-6), last_row)
        if top > bottom:
            continue
        abx, aby, acx, acy, bcx, bcy = bx - ax, by - ay, cx - ax, cy - ay, cx - bx, cy - by
        twice = abx * acy - aby * acx  # the area
        ab, ac, bc = (
            math.sqrt(abx * abx + aby * aby),
            math.sqrt(acx * acx + acy * acy),
            math.sqrt(bcx * bcx + bcy * bcy),
        )
        # Slivers count as flat, because their weights are noise.
        if abs(twice) <= 1e-6 * max(ab, ac, bc) ** 2 + 1e-12:
            continue
        # A pixel counts as inside up to 1e-9 pixels beyond an edge.
        beyond = -1e-9 / abs(twice)
        least_a, least_b, least_c = beyond * bc, beyond * ac, beyond * ab
        over_b, over_c, over_twice = acy / twice, aby / twice, 1 / twice
        for row in range(top, bottom + 1):
            y = row + 0.5 - ay
            start_b, start_c = -y * acx * over_twice, y * abx * over_twice
            for column in range(left, right + 1):
                x = column + 0.5 - ax
                b, c = start_b + x * over_b, start_c - x * over_c
                a = 1 - b - c
                if a < least_a or b < least_b or c < least_c:
                    continue
                here = depth[i] * a + depth[j] * b + depth[k] * c
                if here > nearest[row, column]:
                    nearest[row, column] = here
                    mesh_of[row, column] = number
                    triangle_of[row, column] = triangle


@part
def weigh(
    places: NDArray[np.float64], i: int, j: int, k: int, row: int, column: int
) -> tuple[float, float, float]:
    """Return the barycentric coordinates of a pixel's centre, as `find_visible` computes them."""
    (ax, ay), (bx, by), (cx, cy) = places[i], places[j], places[k]
    abx, aby, acx, acy = bx - ax, by - ay, cx - ax, cy - ay
    twice = abx * acy - aby * acx
    x, y, over_twice = column + 0.5 - ax, row + 0.5 - ay, 1 / twice
    b = -y * acx * over_twice + x * (acy / twice)
    c = y * abx * over_twice - x * (aby / twice)
    return 1 - b - c, b, c


@kernel
def weigh_pixels(
    pixels: NDArray[np.int64],
    width: int,
    triangle_of: NDArray[np.int32],
    triangles: NDArray[np.uint32],
    places: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the barycentric coordinates (k, 3) of pixels of one mesh.

    pixels       (k,), row * width + column
    triangle_of  (height, width), see `find_visible`
    """
    weights = np.empty((len(pixels), 3))
    for n in range(len(pixels)):
        row, column = pixels[n] // width, pixels[n] % width
        i, j, k = triangles[triangle_of[row, column]]
        weights[n, 0], weights[n, 1], weights[n, 2] = weigh(places, i, j, k, row, column)
    return weights
