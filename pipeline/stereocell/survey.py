"""What must be known of the whole dataset before any unit: windows, histograms, transfer functions.

8 bits mean the same in every tile, so a channel's window comes from all of the region, on a coarse
level. Iso-values are found per tile; transfer functions need their mean.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.config import WindowOptions
from stereocell.latticefield import LatticeField
from stereocell.specimen import Look, Verdict
from stereocell.transfer import make_transfer_functions

BINS = 256


@dataclass(frozen=True, slots=True)
class Display:
    """One channel's window in voxel values, voxel counts (256 bins) inside it, its background."""

    window: tuple[float, float]
    histogram: tuple[int, ...]
    background: LatticeField | None


def find_display(
    voxels: NDArray[Any], options: WindowOptions, background: LatticeField | None = None
) -> Display:
    """Return window and histogram of a channel's voxels; a constant channel's window is 1 wide."""
    percentiles = (options.low_percentile, options.high_percentile)
    low, high = (float(v) for v in np.percentile(voxels, percentiles))
    if not high > low:  # sparse channels: fewer bright voxels than the percentile leaves out
        low, high = float(voxels.min()), float(voxels.max())
    if not high > low:
        high = low + 1.0
    counts, _ = np.histogram(np.clip(voxels, low, high), BINS, (low, high))
    return Display((low, high), tuple(int(n) for n in counts), background)


def display_to_json(display: Display) -> dict[str, Any]:
    """Return a display as plain values, as survey.json holds it."""
    field = display.background
    return {
        "window": list(display.window),
        "histogram": list(display.histogram),
        "background": None if field is None else field.to_json(),
    }


def display_from_json(content: Mapping[str, Any]) -> Display:
    """Return the display that `display_to_json` was given; the content has passed its schema."""
    field = content["background"]
    low, high = content["window"]
    return Display(
        (low, high),
        tuple(content["histogram"]),
        None if field is None else LatticeField.from_json(field),
    )


def make_look(
    name: str,
    color: tuple[float, float, float],
    display: Display,
    iso_values: Mapping[str, float | None],
    confidence: float,
    surface: Verdict,
) -> Look:
    """Return how a channel is drawn; iso-values by tile id, confidence and verdict for all."""
    known = [value for value in iso_values.values() if value is not None]
    iso_value = float(np.mean(known)) if known else None
    look = Look(name, color, display.window, iso_value, confidence, surface, {})
    # a level that nothing tells from noise is no place for opacity to begin
    level = look.iso_normalized if surface == "clear" else None
    functions = make_transfer_functions(np.asarray(display.histogram), level)
    return replace(look, transfer_functions=functions)


def look_from(content: Mapping[str, Any]) -> Look:
    """Return the look that survey.json holds."""
    functions = {
        name: tuple((float(x), float(opacity)) for x, opacity in points)
        for name, points in content["transfer_functions"].items()
    }
    return Look(
        content["name"],
        tuple(content["color"]),
        tuple(content["window"]),
        content["iso_value"],
        content["iso_confidence"],
        content["surface"],
        functions,
        content["painted_by"],
    )
