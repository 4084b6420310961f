"""Make the table of a label map's objects: measured columns, joined with a user's table."""

import colorsys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stereocell.model.identifiers import to_identifier
from stereocell.model.object_table import MAX_CATEGORIES, MISSING, Column, ObjectTable
from stereocell.model.unit import ObjectFacts
from stereocell.objects.intensities import merge_quantiles

Triple = tuple[float, float, float]
MEAN = "mean_"  # prefix of a channel's identifier: its mean over each object
P95 = "p95_"  # prefix of a channel's identifier: its 95th percentile over each object


@dataclass(frozen=True, slots=True)
class Place:
    """Positions of n objects: boxes and centroids (n, 3), (z, y, x) um; and volumes (n,)."""

    low_um: NDArray[np.float64]
    high_um: NDArray[np.float64]
    centroid_um: NDArray[np.float64]
    volume_um3: NDArray[np.float64]


def own_columns(
    place: Place, facts: Sequence[tuple[NDArray[np.int32], ObjectFacts]], channels: Sequence[str]
) -> list[Column]:
    """Return the columns that the pipeline measures for n objects.

    place     positions of the objects
    facts     for each tile, its objects' rows in the table, int32 (k,), and their measurements
    channels  names of the image's channels that were measured
    """
    count = len(place.volume_um3)
    area, touching, shared = np.zeros(count), np.zeros(count), np.zeros(count)
    voxels = np.zeros(count)
    means, p95s = np.zeros((count, len(channels))), np.full((count, len(channels)), np.nan)
    cut: dict[int, list[tuple[NDArray[np.float32], int]]] = {}
    for rows, one in facts:
        np.add.at(area, rows, one.area_um2)
        np.add.at(voxels, rows, one.voxels)
        np.add.at(means, rows, one.means * one.voxels[:, np.newaxis])
        p95s[rows] = one.p95s
        for piece, quantiles in zip(one.pieces.tolist(), one.quantiles, strict=True):
            cut.setdefault(int(rows[piece]), []).append((quantiles, int(one.voxels[piece])))
        np.add.at(shared, rows[one.interface_objects], one.interface_um2)
    for row, parts in cut.items():
        held = np.stack([quantiles for quantiles, _ in parts])
        counts = np.array([count for _, count in parts])
        p95s[row] = [merge_quantiles(held[:, k], counts) for k in range(len(channels))]
    # A neighbour that consists of several pieces counts once.
    pairs = [
        np.stack([rows[one.interface_objects].astype(np.uint64), one.beside], 1)
        for rows, one in facts
    ]
    if pairs:
        found = np.unique(np.concatenate(pairs), axis=0)
        touching += np.bincount(found[:, 0].astype(np.int64), minlength=count)
    means /= np.maximum(voxels, 1)[:, np.newaxis]
    volume = place.volume_um3
    round_area = np.pi ** (1 / 3) * (6 * volume) ** (2 / 3)
    extent = place.high_um - place.low_um
    made = [
        ("volume_um3", "volume", volume, "Volume of its voxels", "um3"),
        ("area_um2", "area", area, "Area of its surface at the finest level", "um2"),
        (
            "sphericity",
            "sphericity",
            np.where(area > 0, round_area / np.maximum(area, 1e-12), np.nan),
            "Area of a ball of the same volume, divided by its own area; 1 for a ball",
            "",
        ),
        ("neighbours", "neighbours", touching, "Number of objects that it touches", ""),
        (
            "contact",
            "contact",
            np.where(area > 0, shared / np.maximum(area, 1e-12), np.nan),
            "Share of its surface that touches other objects",
            "",
        ),
    ]
    for axis, letter in ((2, "x"), (1, "y"), (0, "z")):
        about = f"Position of its centroid along {letter}, from the image's first voxel"
        at = place.centroid_um[:, axis]
        made.append((f"centroid_{letter}_um", f"centroid {letter}", at, about, "um"))
    for axis, letter in ((2, "x"), (1, "y"), (0, "z")):
        about = f"Length of its box along {letter}"
        made.append((f"extent_{letter}_um", f"extent {letter}", extent[:, axis], about, "um"))
    for index, name in enumerate(channels):
        mean, p95 = means[:, index], p95s[:, index]
        made.append(
            (
                f"{MEAN}{to_identifier(name)}",
                f"mean {name}",
                mean,
                f"Mean of {name} over its voxels",
                "counts",
            )
        )
        about = f"95th percentile of {name} over its voxels"
        made.append((f"{P95}{to_identifier(name)}", f"p95 {name}", p95, about, "counts"))
    return [
        Column(id_, name, np.asarray(values, np.float32), about, unit)
        for id_, name, values, about, unit in made
    ]


def number_column(name: str, values: NDArray[np.float64], about: str) -> Column:
    """Return a column of numbers, float64 `values` (n,). Infinite values count as missing."""
    with np.errstate(over="ignore"):
        narrow = np.asarray(values, np.float32)
    return Column(to_identifier(name), name, np.where(np.isfinite(narrow), narrow, np.nan), about)


def category_column(
    name: str, texts: Sequence[str], about: str, *, colors: Mapping[str, Triple] | None = None
) -> Column | None:
    """Return a column of categories, or None for more than MAX_CATEGORIES.

    An empty text is a missing value. colors: linear RGB by category.
    """
    words = sorted({text for text in texts if text})
    if not words:  # all values are missing
        return Column(to_identifier(name), name, np.full(len(texts), np.nan, np.float32), about)
    if len(words) > MAX_CATEGORIES:
        return None
    code = {word: float(place) for place, word in enumerate(words)}
    values = np.array([code.get(text, float(MISSING)) for text in texts], np.float32)
    chosen = choose_colors(len(words))
    given = colors or {}
    shown = tuple(given.get(word, chosen[place]) for place, word in enumerate(words))
    return Column(to_identifier(name), name, values, about, "", tuple(words), shown)


NO_CATEGORY = (0.2, 0.2, 0.2)  # linear RGB of objects without a category

# Colours of Okabe & Ito for categories (linear RGB), which colour-blind people can distinguish;
# without black, which is invisible on a dark ground. https://jfly.uni-koeln.de/color/
_OKABE_ITO = tuple(
    tuple(
        ((value / 255 + 0.055) / 1.055) ** 2.4
        for value in (code >> 16, code >> 8 & 255, code & 255)
    )
    for code in (0xE69F00, 0x56B4E9, 0x009E73, 0xF0E442, 0x0072B2, 0xD55E00, 0xCC79A7)
)


def choose_colors(count: int) -> list[Triple]:
    """Return colours for categories, linear RGB: seven clearly different ones, then other hues."""
    found: list[Triple] = [(r, g, b) for r, g, b in _OKABE_ITO[:count]]
    for place in range(len(found), count):
        # Steps of the golden ratio keep successive hues far apart.
        found.append(
            colorsys.hls_to_rgb(place * 0.618033988749895 % 1, (0.35, 0.55)[place % 2], 0.6)
        )
    return found


def hashed_colors(labels: NDArray[np.uint64]) -> NDArray[np.float32]:
    """Return a colour for each object, linear RGB float32 (n, 3); neighbours seldom share one.

    labels  uint64 (n,), the objects' numbers in the label map

    The colours are pastels of many hues, so that none suggests a meaning.
    """
    mixed = labels * np.uint64(0x9E3779B97F4A7C15)  # Fibonacci hashing
    hue = (mixed >> np.uint64(40)).astype(np.float64) / (1 << 24)
    light = 0.4 + 0.2 * ((mixed >> np.uint64(8)) & np.uint64(0xFFFF)).astype(np.float64) / 0xFFFF
    colors = [colorsys.hls_to_rgb(h, level, 0.5) for h, level in zip(hue, light, strict=True)]
    return np.array(colors, np.float32).reshape(-1, 3)


def color_objects(table: ObjectTable) -> NDArray[np.float32]:
    """Return the colour in which each object is first shown, linear RGB float32 (n, 3).

    It follows the table's default column. Without that, it is the label map's own colour, or a hue
    from the object's number.
    """
    column = table.column(table.default)
    if column is None or not column.categories:
        hashed = hashed_colors(table.labels)
        own = hashed if table.colors is None else table.colors
        return np.where(np.isnan(own), hashed, own)
    # A missing value is -1, which is the index of the palette's last row.
    palette = np.array([*column.colors, NO_CATEGORY], np.float32)
    return palette[column.values.astype(np.int64)]
