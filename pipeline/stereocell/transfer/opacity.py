"""Transfer functions from a channel's intensity to opacity, from its histogram and iso-value.

Intensity 0..1 is the channel's window. Opacity, 0..1, is the absorption along one finest voxel
spacing; the ray-marcher corrects it for its own step. The channel's colour is stored separately, so
that a recoloured channel needs no new table.
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.model.channel import OpacityPoints

SOFT = "soft"  # name of the translucent function
SURFACE = "surface"  # name of the function that looks like the surface
SHARP = "sharp"  # name of the function of an opaque body that ends at the level
# Largest mean optical depth of the whole volume along its shortest edge, with the soft function.
# Light then crosses the volume, and bodies show within others, for any number of voxels. Chosen by
# eye on stained cells, nuclei, an ovule and a cleared brain, of 15 to 270 voxels.
SOFT_DEPTH = 0.6
LEAST_SHARE = 0.2  # share of the soft absorption; with less, steps of 8 bits would show as bands
THRESHOLD = "threshold"  # name of the function of channels that have a threshold
RAMP = 0.08  # share of the window over which opacity rises from the threshold
FOOT = 0.95  # largest share of the level at which opacity starts; a step would look jagged
# Share of the way from the background to the surface's level at which opacity starts. The volume
# then begins a quarter of a voxel before the surface, and both have the same silhouette.
NEAR_SURFACE = 0.8
AT_SURFACE = 0.18  # opacity per voxel at the surface's level
IN_BODY = 0.45  # opacity per voxel where the body is bright
BRIGHT = 0.3  # share of the window above the level over which a body becomes bright
# AT_SURFACE and BRIGHT for magnitudes, as MR has them. A cut through such a volume shows tissues by
# their opacity, so the opacity has to rise over all of their values.
AT_SURFACE_OF_MAGNITUDES = 0.12
BRIGHT_OF_MAGNITUDES = 0.5
# Share of the window between the start of a body's opacity and its surface; 36 HU with the presets
# for CT. The values at an edge rise by more than that within a voxel. A step of the opacity would
# look jagged.
BELOW_BODY = 0.012
SOLID_BODY = 0.06  # share of the window above the surface in which a body becomes opaque: 180 HU
NOISE_REACH = 2.5  # half-widths; 1 voxel in 1000 of Gaussian or Rayleigh noise lies beyond
FAINT = 1e-2  # share of the peak's count; rarer noise is ignored, because dim materials are as rare
MAX_SHIFT = 1.5  # largest multiple of the level to which noise moves the start of the opacity


def make_transfer_functions(
    histogram: NDArray[np.int64],
    iso_normalized: float | None,
    *,
    threshold_normalized: float | None = None,
    has_magnitudes: bool = False,
    level_percentile: float = 99.0,
    is_calibrated: bool = False,
    depth_voxels: float = 0.0,
) -> dict[str, OpacityPoints]:
    """Return the opacity points of each function. THRESHOLD is included only with a threshold.

    histogram             int64 (bins,), voxel counts over 0..1 in equal bins
    iso_normalized        iso-value, 0..1; None: the channel has no clear surface
    threshold_normalized  adaptive threshold, 0..1; None: there is none
    has_magnitudes        whether values are magnitudes as in MR, where air is noise in each voxel
    level_percentile      percent of the voxels below the level of a channel without a surface
    is_calibrated         whether values lie on an absolute scale, as the Hounsfield units of CT
    depth_voxels          shortest edge of the volume, in finest voxel spacings; 0: unknown

    The level is the iso-value, or a percentile in a channel without a clear surface.

    >>> histogram = np.zeros(256, np.int64)
    >>> histogram[20], histogram[200] = 9000, 1000  # background and bodies
    >>> functions = make_transfer_functions(histogram, 0.5)
    >>> sorted(functions), [intensity for intensity, opacity in functions["sharp"] if opacity > 0]
    (['default', 'sharp', 'soft', 'surface'], [0.515, 1.0])
    """
    share = np.cumsum(histogram) / max(1, int(histogram.sum()))
    bins = len(histogram)
    median, high = (
        (int(np.searchsorted(share, p)) + 1) / bins for p in (0.5, level_percentile / 100)
    )
    level = float(np.clip(high if iso_normalized is None else iso_normalized, 0.02, 0.96))
    has_surface = iso_normalized is not None
    if is_calibrated and has_surface:
        rise = _rise_of_body(level)
    else:
        below = histogram[: int(level * bins)] if has_magnitudes and has_surface else None
        rise = _rise(level, _foot(level, median, has_surface=has_surface), below, bins)
    floor, top, bright = rise
    start = AT_SURFACE_OF_MAGNITUDES if has_magnitudes else AT_SURFACE
    at_top = start + (IN_BODY - start) * (top - level) / (bright - level)
    soft = _points((floor, 0.0), (top, 0.04), (1.0, 0.2))
    functions = {
        "default": _points((floor, 0.0), (top, at_top), (bright, IN_BODY), (1.0, 0.6)),
        SOFT: _thinned(soft, histogram, depth_voxels),
        SHARP: _points((0.97 * level, 0.0), (min(1.03 * level, 0.99), 0.8), (1.0, 0.9)),
        SURFACE: _points(
            (0.85 * level, 0.0), (level, 0.5), (min(1.15 * level, 0.99), 0.0), (1.0, 0.0)
        ),
    }
    # Opacity is 0 below the threshold, so that the ray-marcher skips bricks without brighter ones.
    if threshold_normalized is not None:
        start = float(np.clip(threshold_normalized, 0.01, 0.97))
        top = start + min(RAMP, 0.9 * (1 - start))
        functions[THRESHOLD] = _points((start, 0.0), (top, 0.45), (1.0, 0.6))
    return functions


def _thinned(
    points: OpacityPoints, histogram: NDArray[np.int64], depth_voxels: float
) -> OpacityPoints:
    """Return the points with opacities reduced until the mean optical depth is SOFT_DEPTH.

    The absorption is reduced at most to the share LEAST_SHARE.
    """
    absorbed = -np.log1p(-evaluate(points, size=len(histogram)).astype(np.float64))
    depth = depth_voxels * float(absorbed @ histogram) / max(1, int(histogram.sum()))
    if depth <= SOFT_DEPTH:
        return points
    share = max(LEAST_SHARE, SOFT_DEPTH / depth)
    return _points(*((x, 1 - (1 - opacity) ** share) for x, opacity in points[1:]))


def _rise_of_body(level: float) -> tuple[float, float, float]:
    """Return where the opacity of a CT's body starts, where its level is, and where it is solid.

    On a calibrated scale nothing of interest lies between air and the surface. Opacity that starts
    half-way would be a veil in front of the skin, and all of the soft tissue in front of bone.
    """
    return max(level - BELOW_BODY, 0.5 * level), level, min(level + SOLID_BODY, 0.99)


def _foot(level: float, median: float, *, has_surface: bool) -> float:
    """Return where opacity starts, above the median because most voxels are background.

    It starts near the level of a surface. In a channel without a surface it starts half-way to the
    level, so that faint structure shows.
    """
    way = NEAR_SURFACE if has_surface else 0.5
    return min(max(median + way * (level - median), way * level), 0.9 * level)


def _rise(
    level: float, floor: float, below: NDArray[np.int64] | None, bins: int
) -> tuple[float, float, float]:
    """Return where opacity starts, where it is that of the level, and where the body is bright.

    floor  lowest value at which opacity starts
    below  int64, voxel counts below the surface of magnitudes; None: values are not magnitudes

    Noise of magnitudes would look like dust in front of a surface, so opacity starts where it ends.
    That is below the level, unless the counts still fall steeply at the level. In that case a part
    of the air lies above the level. The surface leaves it out as specks, and so must the volume.
    """
    share = BRIGHT if below is None else BRIGHT_OF_MAGNITUDES
    bright = max(level + share * (1 - level), level + 0.02)
    if below is not None:
        floor = max(floor, min(_end_of_noise(below) / bins, FOOT * level))
        beyond = level + _noise_beyond(below) / bins
        if beyond > level:
            floor = min(beyond, MAX_SHIFT * level, FOOT * (level + bright) / 2)
    return floor, max(level, floor / FOOT), bright


def _end_of_noise(below: NDArray[np.int64]) -> float:
    """Return where the noise of the background ends, in bins; 0 if the background has no peak.

    below  int64 (bins,), voxel counts below the surface

    The half-width of the peak is measured on the upper side. On the lower side magnitudes are cut
    off: MR has Rayleigh noise.
    """
    if not below.any():
        return 0.0
    smooth = _smoothed(below)
    mode = int(smooth.argmax())
    beyond_half = np.flatnonzero(smooth[mode:] <= smooth[mode] / 2)
    return mode + NOISE_REACH * float(beyond_half[0]) if beyond_half.size else 0.0


def _noise_beyond(below: NDArray[np.int64]) -> float:
    """Return by how many bins noise continues beyond the surface's level.

    The result is 0 if the remaining counts are few, or even like those of the surface's own edge.

    below  int64 (bins,), voxel counts below the surface
    """
    smooth = _smoothed(below)
    last = len(below) - 1
    before = int(0.75 * last)
    peak = float(smooth.max(initial=0.0))
    if last < 4 or peak == 0 or smooth[last] <= FAINT * peak or smooth.argmax() >= before:
        return 0.0
    fall = float(np.log(smooth[before] / smooth[last]))
    if fall < 1:
        return 0.0
    return float(np.log(smooth[last] / (FAINT * peak))) * (last - before) / fall


def _smoothed(counts: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return counts after a Gaussian of two bins; the counts at both ends are repeated."""
    from scipy import ndimage  # slow to import, and only magnitudes need it

    smooth: NDArray[np.float64] = ndimage.gaussian_filter1d(
        counts.astype(np.float64), 2.0, mode="nearest"
    )
    return smooth


def evaluate(points: OpacityPoints, *, size: int = 256) -> NDArray[np.float32]:
    """Return the opacity at `size` intensities from 0 to 1, interpolated between the points.

    points  (intensity, opacity) pairs, rising, 0..1; outside them the opacity is constant
    result  float32 (size,), 0..1
    """
    intensities, opacities = np.array(points, dtype=np.float64).T
    return np.interp(np.linspace(0, 1, size), intensities, opacities).astype(np.float32)


def invisible_below(opacities: NDArray[np.uint8]) -> int:
    """Return the intensity, 0..254, up to which a table of 256 opacities is 0; -1: nowhere.

    Texel k is intensity k. Opacity is linear between texels, so everything up to the last texel
    before the first visible one is invisible.
    """
    shown = opacities > 0
    first = int(shown.argmax()) if shown.any() else 255
    return min(first, 255) - 1


def _points(*points: tuple[float, float]) -> OpacityPoints:
    """Return the origin and the points, rounded so that text files never differ."""
    inner = [(round(x, 4), round(opacity, 4)) for x, opacity in points]
    return ((0.0, 0.0), *inner)
