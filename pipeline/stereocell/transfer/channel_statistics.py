"""What must be known of the whole dataset before any unit: windows, histograms, transfer functions.

8 bits mean the same in every tile, so a channel's window comes from all of the region, on a coarse
level, and so does its threshold.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
    find_adaptive_threshold,
    make_histogram,
)
from stereocell.transfer.boundaries import SuggestedShapes
from stereocell.transfer.ct_tissues import BONE_LEVEL_HU, opening_function, tissue_functions
from stereocell.transfer.opacity import SOFT, make_transfer_functions
from stereocell.transfer.options import WindowOptions
from stereocell.transfer.shapes2d import fall_back

BINS = 256
BRIGHT_SHARE = 0.95  # share of an MR's tissue that is darker than its lightest grey
_AT_ONCE = 1 << 20  # voxels
NO_SUGGESTION = SuggestedShapes(TransferFunctions2d(), "not looked for")
NOTHING_COUNTED = Histogram((), 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class ChannelStatistics:
    """One channel's window in voxel values, voxel counts (256 bins) inside it, its background, the
    2D function that is suggested for it, and the counts that its threshold is read from.
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
    """Return window and histogram of a channel's voxels; a constant channel's window is 1 wide.

    voxels  any shape, any number type, voxel values
    window  lowest and highest voxel value, where they are known; None: they are found

    The voxels are left in another order: a sorted copy would be what the memory of a small build
    peaks at.
    """
    percentiles = (options.low_percentile, options.high_percentile)
    voxels = voxels.reshape(-1)
    low, high = (float(v) for v in np.percentile(voxels, percentiles, overwrite_input=True))
    if not high > low:  # sparse channels: fewer bright voxels than the percentile leaves out
        low, high = float(voxels.min()), float(voxels.max())
    if not high > low:
        high = low + max(1.0, 1e-6 * abs(low))  # more than float32 tells apart
    if window is not None:
        low, high = window
    if voxels.dtype.kind == "f" and high - low < 1e-3 * max(abs(low), abs(high)):
        voxels = voxels.astype(np.float64)  # bins so narrow that float32 has no edges for them
    counts = np.zeros(BINS, np.int64)
    for start in range(0, voxels.size, _AT_ONCE):  # clipped, an integer takes eight bytes
        part = np.clip(voxels[start : start + _AT_ONCE], low, high)
        counts += np.histogram(part, BINS, (low, high))[0]
    values = make_histogram(voxels, (low, high))
    return ChannelStatistics((low, high), tuple(int(n) for n in counts), background, values=values)


def make_appearance(
    name: str,
    color: tuple[float, float, float],
    *,
    statistics: ChannelStatistics,
    level: SurfaceLevel | None,
    confidence: float,
    doubt: str,
    modality: str = "",
    is_hounsfield: bool = True,
    unevenness: float = 1.0,
    level_percentile: float = 99.0,
    depth_voxels: float = 0.0,
) -> Appearance:
    """Return how a channel is drawn; `level`: where its surface lies, else why there is none.

    doubt     why there is no level, or why the level cannot be called clear; empty: it can
    modality  DICOM's code; a CT has functions by tissue too, an MR noise of magnitudes. Empty: of a
        microscope, whose volumes open translucent, so that bodies show within others
    is_hounsfield  whether a CT's values are Hounsfield units: else it has no functions by tissue
    unevenness  coarsest over finest voxel spacing; a CT of thick slices opens in one colour
    level_percentile  percent of the voxels below the level of a volume without a surface
    depth_voxels  shortest edge of the volume, in finest voxel spacings; 0: not known
    """
    iso_value, threshold = None, None
    if level is not None:
        below = 0.0 if level.background is None else float(level.background.values.mean())
        iso_value = level.iso + below
        # where nothing tells a surface from noise, peaks of the histogram are noise too
        threshold = statistics.threshold
    surface: SurfaceConfidence = "none" if level is None else "clear"
    if level is not None and doubt:
        surface = "unsure"
        doubt = f"unsure surface: at {level.words}: {doubt}"
    elif level is not None and confidence < LOW_CONFIDENCE:
        surface = "unsure"
        doubt = (
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
        surface_reason=doubt,
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
    """Return the name and the shapes of a 2D function that colours values; None: there is none.

    opacity   of the general function
    modality  DICOM's code; of a CT only where its values are Hounsfield units
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
