"""The bricks that a camera's view needs, in the order of their screen-space error.

A brick's worth is the cost of its absence, in which case its parent is shown. It is the product of
the parent's error, the size of the brick's box on the screen, and a weight that falls off from the
gaze's direction. A brick never comes before its parent: its worth is at most the parent's, and a
tie puts the coarser brick first.

References: Guthe & Strasser, "Advanced techniques for high-quality multi-resolution volume
rendering", Computers & Graphics 28(1), 2004, https://doi.org/10.1016/j.cag.2003.10.018
Levoy & Whitaker, "Gaze-directed volume rendering", Symposium on Interactive 3D Graphics, 1990
Gribb & Hartmann, "Fast extraction of viewing frustum planes from the world-view-projection
matrix", 2001
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.formats.brick_stream import Table
from stereocell.formats.voxel_bvh import EMPTY, STREAM_BRICK
from stereocell.model.errors import SourceError

_FOVEA_RAD = math.radians(20)  # rad, angle to the gaze at which a brick's worth is halved
_ROOT_ERROR = 255.0  # grey values; the error while the root is missing

Floats = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class View:
    """A client's camera, with the fields of the message `view`; vectors (x, y, z) in um, world.

    clip               (4, 4) for column vectors; row i, column j
    pixels_per_radian  resolution of the screen
    texel_px           longest edge of a texel on the screen, pixels
    error_grey         error that needs no refinement, 0..255
    """

    clip: NDArray[np.float64]
    eye: NDArray[np.float64]
    gaze: NDArray[np.float64]
    pixels_per_radian: float
    texel_px: float
    error_grey: float = 0.0


@dataclass(frozen=True, slots=True)
class PlacedTree:
    """A tree at its tile's place; n nodes in breadth-first order.

    center, half  (n, 3), centre and half the edges of each node's box: (x, y, z) in um, in the
                  tile's space, before its matrix
    to_world      (4, 4) for column vectors, from the tile's space; to_tile is its inverse
    texel_um      longest edge of a finest texel
    parents       (n,), index of each node's parent; the root's is 0
    error_max, error_rms  (n,), grey values 0..255
    """

    center: Floats
    half: Floats
    to_world: NDArray[np.float64]
    to_tile: NDArray[np.float64]
    texel_um: float
    level: NDArray[np.uint8]
    parents: NDArray[np.int64]
    error_max: NDArray[np.uint8]
    error_rms: Floats
    is_empty: NDArray[np.bool_]
    level_ends: NDArray[np.int64]


def place(table: Table, entry: dict[str, Any]) -> PlacedTree:
    """Return a tree in the box of its volume.

    entry  the volume's entry in volumes.json

    The boxes enclose the part that is drawn: they end at the centres of the last texels inside the
    apron. A node that holds nothing but apron gets a box with negative edges. Raises SourceError
    for a matrix that can't be inverted.
    """
    nodes = table.nodes
    size = np.array(table.size[::-1], dtype=np.float64)
    low_um, high_um = (
        np.array(entry["bounds_um"][key], dtype=np.float64) for key in ("min", "max")
    )
    first = entry["apron"] + 0.5
    count = size - 2 * first
    spacing = np.where(count > 0, (high_um - low_um) / np.where(count > 0, count, 1), 1.0)
    at = np.stack([nodes[axis] for axis in "xyz"], axis=1).astype(np.float64)
    edge = (STREAM_BRICK * np.exp2(nodes["level"].astype(np.float64)))[:, np.newaxis]
    low = np.maximum(at * edge, first) - first
    high = np.minimum((at + 1) * edge, size - first) - first
    low_box, high_box = low_um + low * spacing, low_um + high * spacing
    # y runs down the image in the texture, and up in the world
    low_box[:, 1], high_box[:, 1] = (
        high_um[1] - high[:, 1] * spacing[1],
        high_um[1] - low[:, 1] * spacing[1],
    )
    parents = np.repeat(np.arange(len(nodes)), np.bitwise_count(nodes["child_mask"]))
    levels = int(nodes["level"][0])
    to_world = np.array(entry["matrix"], dtype=np.float64).reshape(4, 4).T
    try:
        to_tile = np.linalg.inv(to_world).astype(np.float64)
    except np.linalg.LinAlgError:
        raise SourceError(f"tile {entry['tile']}: its matrix can't be inverted") from None
    return PlacedTree(
        ((low_box + high_box) / 2).astype(np.float32),
        ((high_box - low_box) / 2).astype(np.float32),
        to_world,
        to_tile,
        float(spacing.max()),
        nodes["level"].copy(),
        np.concatenate([[0], parents]),
        nodes["error_max"].copy(),
        nodes["error_rms"].copy(),
        (nodes["flags"] & EMPTY) != 0,
        np.array([np.searchsorted(levels - nodes["level"], k + 1) for k in range(levels + 1)]),
    )


def order(
    view: View, trees: Sequence[PlacedTree]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Return tree (index into `trees`), node and worth of the bricks that a view needs, in order.

    All three are (k,). A root is needed if its box is in the frustum. A child is needed if its
    parent is needed, its own box is in the frustum, and the parent is too coarse. Too coarse means
    that its texels are longer than `texel_px` on the screen at the nearest point of its box, and
    that its error_max exceeds `error_grey`. Empty nodes are never sent.
    """
    trees_, nodes, worths, levels = [], [], [], []
    for i, tree in enumerate(trees):
        wanted, worth = _weigh(view, tree)
        found = np.flatnonzero(wanted & ~tree.is_empty)
        trees_.append(np.full(len(found), i))
        nodes.append(found)
        worths.append(worth[found])
        levels.append(tree.level[found])
    tree_of, node, worth, level = map(np.concatenate, (trees_, nodes, worths, levels))
    best = np.lexsort((node, tree_of, -level.astype(np.int64), -worth))
    return tree_of[best], node[best], worth[best]


def _weigh(view: View, tree: PlacedTree) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Return a mask (n,) of the nodes that the view needs, and the worth of each, (n,).

    Both are computed in the tile's own space, where boxes are axis-aligned. This is exact if the
    tile's matrix scales all axes alike: ratios of size to distance are then the world's.
    """
    eye = (tree.to_tile @ np.append(view.eye, 1.0))[:3]
    gaze = tree.to_tile[:3, :3] @ view.gaze
    gaze = gaze / max(float(np.linalg.norm(gaze)), 1e-30)
    inside = _in_frustum(view.clip @ tree.to_world, tree.center, tree.half)

    away = tree.center - eye
    gap = np.maximum(np.abs(away) - tree.half, 0)
    distance = np.maximum(np.linalg.norm(gap, axis=1), tree.texel_um / 2)
    radius = np.linalg.norm(tree.half, axis=1)
    far = np.maximum(np.linalg.norm(away, axis=1), 1e-30)
    angle = np.arccos(np.clip(away @ gaze / far, -1, 1))
    angle -= np.arcsin(np.clip(radius / far, 0, 1))
    weight = 1 / (1 + (np.maximum(angle, 0) / _FOVEA_RAD) ** 2)
    on_screen = np.minimum(2 * radius / distance, math.pi) * weight

    texel = tree.texel_um * np.exp2(tree.level.astype(np.float64))
    coarse = (texel / distance * view.pixels_per_radian > view.texel_px) & (
        tree.error_max > view.error_grey
    )
    worth = tree.error_rms[tree.parents] * on_screen
    worth[0] = _ROOT_ERROR * on_screen[0]
    wanted = inside
    for start, end in zip(tree.level_ends[:-1], tree.level_ends[1:], strict=True):
        parents = tree.parents[start:end]
        wanted[start:end] &= wanted[parents] & coarse[parents]
        worth[start:end] = np.minimum(worth[start:end], worth[parents])
    return wanted, worth


def _in_frustum(clip: NDArray[np.float64], center: Floats, half: Floats) -> NDArray[np.bool_]:
    """Return a mask (n,) of the boxes that reach into the half-spaces -w <= x, y, z <= w."""
    planes = np.concatenate([clip[3] + clip[:3], clip[3] - clip[:3]])
    reach = center @ planes[:, :3].T + half @ np.abs(planes[:, :3]).T + planes[:, 3]
    return (reach >= 0).all(axis=1) & (half >= 0).all(axis=1)
