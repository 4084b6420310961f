"""Statistics of the whole dataset that every unit needs: windows, histograms, transfer functions.

An 8-bit value means the same in every tile. So a channel's window and threshold are found on the
whole region, at a coarse level.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.filters.percentiles import find_percentiles
from stereocell.model.channel import (
    LOW_CONFIDENCE,
    Appearance,
    OpacityPoints,
    Shapes,
    SurfaceConfidence,
    SurfaceLevel,
    TransferFunctions2d,
)
from stereocell.model.lattice_field import LatticeField
from stereocell.model.modality import TRACER_MODALITIES
from stereocell.transfer import ct_colors, heat, mr_grey
from stereocell.transfer.adaptive_threshold import (
    Histogram,
    Threshold,
    count_in_bins,
    find_adaptive_threshold,
    make_histogram,
)
from stereocell.transfer.boundaries import SuggestedShapes
from stereocell.transfer.ct_tissues import BONE_LEVEL_HU, opening_function, tissue_functions
from stereocell.transfer.opacity import SOFT, make_transfer_functions
from stereocell.transfer.options import WindowOptions
from stereocell.transfer.shapes2d import fall_back

BINS = 256
BRIGHT_SHARE = 0.95  # share of an MR's tissue that is darker than the lightest grey
NO_SUGGESTION = SuggestedShapes(TransferFunctions2d(), "not looked for")
NOTHING_COUNTED = Histogram((), 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class ChannelStatistics:
    """The statistics of one channel over the whole dataset.

    window      voxel values that become 0 and 255
    histogram   voxel counts in 256 bins of the window
    background  values that a build subtracts from the voxels; None: it subtracts none
    suggested   2D function for the channel
    values      counts from which the threshold is found
    """

    window: tuple[float, float]
    histogram: tuple[int, ...]
    background: LatticeField | None
    suggested: SuggestedShapes = NO_SUGGESTION
    values: Histogram = NOTHING_COUNTED

    @property
    def threshold(self) -> Threshold | None:
        return find_adaptive_threshold(self.values)


def find_statistics(
    voxels: NDArray[Any],
    options: WindowOptions,
    *,
    background: LatticeField | None = None,
    window: tuple[float, float] | None = None,
) -> ChannelStatistics:
    """Return the window and the histogram of a channel. A constant channel has a window of width 1.

    voxels      any shape, any number type, voxel values; they may be reordered in place, because
                the peak memory of a small build would be a sorted copy
    background  values that a build subtracts from the voxels; None: it subtracts none
    window      lowest and highest voxel value if known; None: they are found

    >>> z, y, x = np.ogrid[-16:16, -16:16, -16:16]
    >>> ball = np.where(z**2 + y**2 + x**2 < 100, 900, 100).astype(np.uint16)
    >>> found = find_statistics(ball, WindowOptions())
    >>> found.window, found.histogram[0], found.histogram[-1]  # voxels outside and inside
    ((100.0, 900.0), 28629, 4139)
    """
    percentiles = (options.low_percentile, options.high_percentile)
    voxels = voxels.reshape(-1)
    low, high = find_percentiles(voxels, percentiles, overwrites=True)
    if not high > low:  # a sparse channel has fewer bright voxels than the percentile leaves out
        low, high = float(voxels.min()), float(voxels.max())
    if not high > low:
        # The window becomes so wide that float32 distinguishes its ends.
        high = low + max(1.0, 1e-6 * abs(low))
    if window is not None:
        low, high = window
    edges = np.linspace(low, high, BINS + 1)
    counts = count_in_bins(voxels, edges, (low, high), clips=True)
    values = make_histogram(voxels, (low, high))
    return ChannelStatistics((low, high), tuple(int(n) for n in counts), background, values=values)


def make_appearance(
    name: str,
    color: tuple[float, float, float],
    *,
    statistics: ChannelStatistics,
    level: SurfaceLevel | None,
    confidence: float,
    why_unclear: str,
    modality: str = "",
    is_hounsfield: bool = True,
    unevenness: float = 1.0,
    level_percentile: float = 99.0,
    depth_voxels: float = 0.0,
) -> Appearance:
    """Return how a channel is drawn.

    level             where its surface lies; None: it has no surface
    why_unclear       why there is no level, or why the level is not clear; empty if it is clear
    modality          DICOM's code. CT has functions by tissue, and MR has noise of magnitudes. It
                      is empty for a microscope, whose volumes are translucent at first, so that
                      bodies show within others.
    is_hounsfield     whether a CT's values are Hounsfield units; otherwise it has no functions by
                      tissue
    unevenness        coarsest over finest voxel spacing; a CT of thick slices has one colour at
                      first
    level_percentile  percent of the voxels below the level of a volume without a surface
    depth_voxels      shortest edge of the volume, in finest voxel spacings; 0: unknown
    """
    iso_value, threshold = None, None
    if level is not None:
        below = 0.0 if level.background is None else float(level.background.values.mean())
        iso_value = level.iso + below
        # If no level is distinguished from noise, peaks of the histogram are noise as well.
        threshold = statistics.threshold
    surface: SurfaceConfidence = "none" if level is None else "clear"
    if level is not None and why_unclear:
        surface = "unsure"
        why_unclear = f"unsure surface: at {level.words}: {why_unclear}"
    elif level is not None and confidence < LOW_CONFIDENCE:
        surface = "unsure"
        why_unclear = (
            f"unsure surface: at {level.words} with a confidence of {confidence:.2f}; "
            f"below {LOW_CONFIDENCE:g} about half of such surfaces are right"
        )
    appearance = Appearance(
        name,
        color,
        statistics.window,
        iso_value,
        confidence,
        surface,
        {},
        threshold=None if threshold is None else threshold.value,
        surface_reason=why_unclear,
        level=level,
    )
    functions = make_transfer_functions(
        np.asarray(statistics.histogram),
        appearance.iso_normalized,
        threshold_normalized=appearance.threshold_normalized,
        has_magnitudes=modality == "MR",
        level_percentile=level_percentile,
        is_calibrated=modality == "CT",
        depth_voxels=depth_voxels,
    )
    function = SOFT if modality == "" and level is not None else None
    if modality == "CT" and is_hounsfield:
        functions |= tissue_functions(statistics.window)
        function = opening_function(iso_value, functions)
    transfer_2d = statistics.suggested.transfer_2d
    known = "" if modality == "CT" and not is_hounsfield else modality
    coloured = _coloured_function(appearance, statistics, functions["default"], known)
    if coloured is not None:
        name_2d, shapes = coloured
        transfer_2d = replace(transfer_2d, functions={**transfer_2d.functions, name_2d: shapes})
        if name_2d != ct_colors.NAME or unevenness <= ct_colors.MAX_UNEVEN:
            function = name_2d
    for name_2d, shapes in transfer_2d.functions.items():
        functions[name_2d] = fall_back(shapes)
    return replace(
        appearance,
        transfer_functions=functions,
        transfer_2d=transfer_2d,
        function=function or appearance.function,
    )


def _coloured_function(
    appearance: Appearance,
    statistics: ChannelStatistics,
    opacity: OpacityPoints,
    modality: str,
) -> tuple[str, Shapes] | None:
    """Return the name and the shapes of a 2D function that colours values, or None.

    opacity   opacity points of the general function
    modality  DICOM's code; empty for a CT whose values are not Hounsfield units
    """
    level, gradient_max = appearance.iso_normalized, statistics.suggested.transfer_2d.gradient_max
    if modality in TRACER_MODALITIES:
        organs = level
        if organs is None:
            organs = next(x for x, absorbed in opacity if absorbed > 0)
        return heat.NAME, heat.heat_shapes(organs, appearance.threshold_normalized)
    if level is None or appearance.iso_value is None:
        return None
    if modality == "CT" and appearance.iso_value < BONE_LEVEL_HU:
        shapes = ct_colors.tissue_shapes(appearance.iso_value, statistics.window, gradient_max)
        return (ct_colors.NAME, shapes) if shapes else None
    if modality == "MR":
        counts = np.cumsum(statistics.histogram[int(level * BINS) :])
        within = float(np.searchsorted(counts, BRIGHT_SHARE * counts[-1])) / BINS
        brightest = min(level + within, 1.0)
        return mr_grey.NAME, mr_grey.grey_shapes(level, brightest, opacity, gradient_max)
    return None
