"""Light the visible points of a mesh."""

import math

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel
from stereocell.kernels.depth_buffer import weigh


@kernel
def light_pixels(
    number: int,
    mesh_of: NDArray[np.int32],
    triangle_of: NDArray[np.int32],
    triangles: NDArray[np.uint32],
    places: NDArray[np.float64],
    normals: NDArray[np.float32],
    colors: NDArray[np.float64],
    axes: NDArray[np.float64],
    lamps: NDArray[np.float64],
    ground: float,
    sky: float,
    gloss: float,
    picture: NDArray[np.float64],
) -> None:
    """Fill the pixels where a mesh is visible with linear light.

    number                of the mesh
    mesh_of, triangle_of  of `find_visible`
    triangles             (m, 3)
    places                (n, 2), vertices in pixels: x right, y down
    normals               (n, 3), world
    colors                linear RGB, (n, 3) of vertices or (1, 3) of all
    axes                  (3, 3), columns are right, up, and to the eye in the world
    lamps                 (k, 7): direction to the lamp, direction halfway between the lamp and the
                          eye, both of length 1, and the light
    ground, sky           light from below and from above
    gloss                 share of the light that the surface reflects as a mirror does
    picture               (height, width, 3)
    """
    height, width = mesh_of.shape
    normal, turned = np.zeros(3), np.zeros(3)
    for row in range(height):
        for column in range(width):
            if mesh_of[row, column] != number:
                continue
            i, j, k = triangles[triangle_of[row, column]]
            a, b, c = weigh(places, i, j, k, row, column)
            for axis in range(3):
                normal[axis] = a * normals[i, axis] + b * normals[j, axis] + c * normals[k, axis]
            abx, aby = places[j, 0] - places[i, 0], places[j, 1] - places[i, 1]
            acx, acy = places[k, 0] - places[i, 0], places[k, 1] - places[i, 1]
            # A clockwise triangle, as y is down, shows its inside, which is drawn, too.
            side = -1.0 if abx * acy - aby * acx > 0 else 1.0
            for axis in range(3):
                turned[axis] = side * (
                    normal[0] * axes[0, axis]
                    + normal[1] * axes[1, axis]
                    + normal[2] * axes[2, axis]
                )
            length = math.sqrt(turned[0] ** 2 + turned[1] ** 2 + turned[2] ** 2)
            length = max(length, 1e-20)
            x, y, z = turned[0] / length, turned[1] / length, turned[2] / length
            above = 0.5 + 0.5 * y
            diffuse, shine = ground * (1 - above) + sky * above, 0.0
            for lamp in lamps:
                diffuse += lamp[6] * max(x * lamp[0] + y * lamp[1] + z * lamp[2], 0.0)
                mirrored = max(x * lamp[3] + y * lamp[4] + z * lamp[5], 0.0)
                power8 = mirrored**8
                shine += lamp[6] * power8 * power8 * power8 * mirrored  # to the power of 25
            for channel in range(3):
                if len(colors) == 1:
                    color = colors[0, channel]
                else:
                    color = a * colors[i, channel] + b * colors[j, channel] + c * colors[k, channel]
                picture[row, column, channel] = diffuse * color + gloss * shine


@kernel
def shrink(drawn: NDArray[np.float64], factor: int, small: NDArray[np.float64]) -> None:
    """Write the means of factor x factor pixels.

    drawn  (height * factor, width * factor, channels)
    small  (height, width, channels)
    """
    height, width, channels = small.shape
    for row in range(height):
        for column in range(width):
            for channel in range(channels):
                total = 0.0
                for down in range(factor):
                    for on in range(factor):
                        total += drawn[row * factor + down, column * factor + on, channel]
                small[row, column, channel] = total / (factor * factor)


@kernel
def shrink_visible(
    drawn: NDArray[np.float64],
    nearest: NDArray[np.float64],
    factor: int,
    small: NDArray[np.float64],
    cover: NDArray[np.float64],
) -> None:
    """Write the means of those of factor x factor pixels that show a surface, and their share.

    drawn    (height * factor, width * factor, channels)
    nearest  (height * factor, width * factor), depth; minus infinity where nothing is visible
    small    (height, width, channels); 0 where nothing is visible
    cover    (height, width), share of the pixels that show a surface
    """
    height, width, channels = small.shape
    of_all = factor * factor
    for row in range(height):
        for column in range(width):
            hits = 0.0
            for down in range(factor):
                for on in range(factor):
                    hits += nearest[row * factor + down, column * factor + on] > -np.inf
            cover[row, column] = hits / of_all
            for channel in range(channels):
                total = 0.0
                for down in range(factor):
                    for on in range(factor):
                        if nearest[row * factor + down, column * factor + on] > -np.inf:
                            total += drawn[row * factor + down, column * factor + on, channel]
                small[row, column, channel] = total / of_all / max(cover[row, column], 1e-9)
