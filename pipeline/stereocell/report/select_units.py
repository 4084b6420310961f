"""Choose what a page can carry: evenly spread units, and a level of detail that draws in time."""

from collections.abc import Sequence

FEWEST_TILES = 6  # shown of a build with very many channels, each with some of them
_GOLDEN = (5**0.5 - 1) / 2


def choose_units(tiles: int, channels: int, most: int) -> list[tuple[int, list[int]]]:
    """Return which units are pictured: (tile, its channels), all by index; at most `most` units.

    All of them if they fit. Else evenly spaced tiles with all channels; where so few tiles would
    fit that they say little of the specimen, more tiles with some channels each, not always the
    same ones.
    """
    if tiles * channels <= most:
        return [(tile, list(range(channels))) for tile in range(tiles)]
    chosen = min(tiles, most, max(FEWEST_TILES, most // channels))
    each = min(channels, most // chosen)
    picked = []
    for i in range(chosen):
        shift = i * channels // (each * chosen) if each < channels else 0
        shown = {(j * channels // each + shift) % channels for j in range(each)}
        picked.append(((2 * i + 1) * tiles // (2 * chosen), sorted(shown)))
    return picked


def choose_level(triangles: Sequence[Sequence[int]], most: int) -> tuple[int, int]:
    """Return the finest level at which meshes can be drawn, and every how manyth of them is.

    `triangles`: per mesh, of each of its levels, finest first; at least one mesh. If even the
    coarsest level of all is more than `most` triangles, only every k-th mesh is drawn.
    """
    levels = max(len(mesh) for mesh in triangles)
    for level in range(levels):
        total = sum(mesh[min(level, len(mesh) - 1)] for mesh in triangles)
        if total <= most:
            return level, 1
    return levels - 1, -(-total // most)


def thin_out(count: int, every: int) -> list[int]:
    """Return about one in `every` of the indices below `count`, rising.

    Steps of the golden ratio: a fixed stride could hit the same channel in every tile.
    """
    return [i for i in range(count) if i * _GOLDEN % 1 < 1 / every]
