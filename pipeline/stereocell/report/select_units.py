"""Choose units for a page, evenly spread, and a level of detail that draws in time."""

from collections.abc import Sequence

MIN_TILES = 6  # tiles that get pictures at least, also where there are many channels
_GOLDEN = (5**0.5 - 1) / 2  # 1 / golden ratio


def choose_units(tiles: int, channels: int, most: int) -> list[tuple[int, list[int]]]:
    """Return the units to draw: pairs of a tile's index and its channels' indices.

    most  largest number of units

    All units are drawn if they are few enough. Otherwise evenly spaced tiles are drawn with all
    channels. If that leaves fewer than MIN_TILES tiles, more tiles are drawn, each with some of the
    channels in rotation.
    """
    if tiles * channels <= most:
        return [(tile, list(range(channels))) for tile in range(tiles)]
    chosen = min(tiles, most, max(MIN_TILES, most // channels))
    each = min(channels, most // chosen)
    picked = []
    for i in range(chosen):
        shift = i * channels // (each * chosen) if each < channels else 0
        shown = {(j * channels // each + shift) % channels for j in range(each)}
        picked.append(((2 * i + 1) * tiles // (2 * chosen), sorted(shown)))
    return picked


def choose_level(triangles: Sequence[Sequence[int]], most: int) -> tuple[int, int]:
    """Return the finest level of detail to draw, and k: about one in k meshes is drawn.

    triangles  for each mesh, the number at each of its levels, finest first; at least one mesh
    most       largest number of triangles to draw

    k is 1 unless even the coarsest levels of all meshes together exceed `most`.
    """
    levels = max(len(mesh) for mesh in triangles)
    for level in range(levels):
        total = sum(mesh[min(level, len(mesh) - 1)] for mesh in triangles)
        if total <= most:
            return level, 1
    return levels - 1, -(-total // most)


def thin_out(count: int, every: int) -> list[int]:
    """Return about one in `every` of the indices below `count`, in rising order.

    The indices are spread by the golden ratio, because a fixed stride could pick the same channel
    in every tile.
    """
    return [i for i in range(count) if i * _GOLDEN % 1 < 1 / every]
