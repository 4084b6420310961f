"""Masks of a head and of its brain, from thresholds, a hull (tissue/brain_hull.py) and fluid.

The hull starts at the bright tissue that erosion leaves, as in Shattuck et al. It is found twice.
Before the second time a rough bias field, measured inside the first hull, is removed. Lengths are
in um, not in voxels.

References
D. W. Shattuck, S. R. Sandor-Leahy, K. A. Schaper, D. A. Rottenberg & R. M. Leahy, "Magnetic
resonance image tissue classification using a partial volume model", NeuroImage 13, 2001.
doi:10.1006/nimg.2000.0730
N. Otsu, "A threshold selection method from gray-level histograms", IEEE Trans. Systems, Man, and
Cybernetics 9, 1979. doi:10.1109/TSMC.1979.4310076
"""

from typing import Any

import cc3d
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from skimage.filters import threshold_multiotsu, threshold_otsu

from stereocell.model.errors import SourceError
from stereocell.tissue.brain_hull import Hull, fill_hull, find_hull

Mask = NDArray[np.bool_]
Triple = tuple[float, float, float]
COARSE_UM = 2000.0  # um; approximate size of the voxels in which the hull is found
NOISE_UM = 800.0  # um; sigma of the smoothing of those voxels
BIAS_UM = 20_000.0  # um; sigma of the rough bias field
ERODED_UM = 4500.0  # um; erosion that separates the brain from scalp, optic nerves and dura
GYRI_UM = 3000.0  # um; bright tissue within this distance of the hull belongs to the brain
RIM_UM = 12000.0  # um; largest distance of the fluid from the hull
CALM = 0.3  # share of the dark voxels, of lowest gradient, in which bone and fluid are compared
PARTED = 0.85  # least separability of bone and fluid, 0..1; an even distribution has .75


def find_foreground(smooth: NDArray[np.float32]) -> Mask:
    """Return the foreground, bool (z, y, x): Otsu's class of log values, largest component.

    smooth  float32 (z, y, x), voxel values, noise smoothed

    Raises SourceError for a constant volume.
    """
    if smooth.min() == smooth.max():
        raise SourceError(f"every voxel is {smooth.flat[0]:g}, expected tissue of several kinds")
    sample = smooth[::2, ::2, ::2]
    values = np.log1p(np.maximum(sample - np.percentile(sample, 1), 0))
    level = np.expm1(float(threshold_otsu(values))) + np.percentile(sample, 1)
    mask = _largest(smooth > level)
    return np.asarray(ndimage.binary_fill_holes(mask), np.bool_)


def find_brain(smooth: NDArray[np.float32], head: Mask, spacing_um: Triple) -> Mask:
    """Return the brain with the fluid in and around it, bool (z, y, x).

    smooth      float32 (z, y, x), voxel values, noise smoothed
    head        bool (z, y, x), the foreground
    spacing_um  (z, y, x)

    If fluid differs from bone, the mask follows it outward from the hull. If it is as dark as bone,
    its outer boundary is unknown, and the result is the hull. Raises SourceError if there is no
    brain to start from.
    """
    coarse, inside, spacing = _coarsen(smooth, head, spacing_um)
    hull, tissue_level = _find_hull(coarse, inside, spacing)
    brain = fill_hull(
        hull, _shape(smooth), spacing_mm=_mm(spacing_um), shift_mm=_shift(spacing, spacing_um)
    )
    brain &= head
    if not brain.any():
        raise SourceError("no brain: the hull holds no voxel, expected a head in MR")
    return _add_fluid(brain, smooth, head, tissue_level, spacing_um)


def _find_hull(field: NDArray[np.float32], head: Mask, spacing_um: Triple) -> tuple[Hull, float]:
    """Return the hull, and the level above which voxels are tissue, not fluid, bone or air."""
    level = float(threshold_multiotsu(field[head], 3)[0])
    tissue = head & (field > level)
    core = _within(tissue, -ERODED_UM, spacing_um)
    if not core.any():
        raise SourceError(
            "no brain: bright tissue is nowhere 9 mm thick, expected a head in MR (or --everywhere)"
        )
    core = _within(_largest(core), ERODED_UM, spacing_um) & tissue
    mm = _mm(spacing_um)
    at = ndimage.center_of_mass(core)
    center = (at[0] * mm[0], at[1] * mm[1], at[2] * mm[2])
    radius = float(np.cbrt(3 / (4 * np.pi) * core.sum() * np.prod(mm)))

    hull = find_hull(
        field, mm, center_mm=center, radius_mm=radius, levels=_levels(field, head, core)
    )
    brain = fill_hull(hull, _shape(field), spacing_mm=mm) & tissue
    if not brain.any():
        raise SourceError("no brain: the hull holds no bright tissue, expected a head in MR")
    flat = field / _rough_bias(field, brain, spacing_um)
    return find_hull(
        flat, mm, center_mm=center, radius_mm=radius, levels=_levels(flat, head, brain)
    ), level


def _levels(field: NDArray[np.float32], head: Mask, brain: Mask) -> Triple:
    """Return the voxel values for `find_hull`: dark, least bright value, the brain's median."""
    dark, bright = float(np.percentile(field, 2)), float(np.percentile(field[head], 98))
    return dark, dark + 0.1 * (bright - dark), float(np.median(field[brain]))


def _rough_bias(field: NDArray[np.float32], brain: Mask, spacing_um: Triple) -> NDArray[np.float32]:
    """Return the rough bias field: about 1, from the blurred field in the brain; 1 far from it."""
    sigma = [BIAS_UM / h for h in spacing_um]
    weight = ndimage.gaussian_filter(brain.astype(np.float32), sigma)
    log = np.log(np.maximum(field, np.float32(1e-6) * field.max())) * brain
    blur = ndimage.gaussian_filter(log, sigma) / np.maximum(weight, 1e-6)
    blur -= np.median(blur[brain])
    return np.where(weight > 0.02, np.exp(blur), np.float32(1)).astype(np.float32)


def _add_fluid(
    brain: Mask, smooth: NDArray[np.float32], head: Mask, level: float, spacing_um: Triple
) -> Mask:
    tissue = head & (smooth > level)
    near = _within(brain, RIM_UM, spacing_um) & head
    places = np.flatnonzero(near & ~tissue & ~brain)
    places = places[:: max(1, len(places) // 1_000_000)]
    if len(places) < 100:
        return brain
    dark = smooth.ravel()[places]
    steep = ndimage.gaussian_gradient_magnitude(smooth, 0.5).ravel()[places]
    if _separability(dark[steep <= np.quantile(steep, CALM)]) < PARTED:
        return brain
    split = float(threshold_otsu(dark))
    bone, fluid = dark[dark <= split], dark[dark > split]
    # Half-way between their medians, because voxels of mixed content move Otsu's level up.
    split = min(0.5 * float(np.median(bone) + np.median(fluid)), split)
    near &= (smooth > split) & (~tissue | _within(brain, GYRI_UM, spacing_um))
    return np.asarray(ndimage.binary_fill_holes(_touching(near, brain)), np.bool_)


def _separability(values: NDArray[np.float32]) -> float:
    """Return the share of the variance between Otsu's two classes (his eta), 0..1."""
    if values.min() == values.max():
        return 0.0
    split = float(threshold_otsu(values))
    low, high = values[values <= split], values[values > split]
    share = len(low) / len(values)
    between = share * (1 - share) * float(low.mean() - high.mean()) ** 2
    return between / float(values.var())


def _coarsen(
    field: NDArray[np.float32], mask: Mask, spacing_um: Triple
) -> tuple[NDArray[np.float32], Mask, Triple]:
    """Return smoothed means over cubes of COARSE_UM, the mask by majority, and the spacing."""
    z, y, x = (max(1, round(COARSE_UM / h)) for h in spacing_um)
    d, h, w = (n // k for n, k in zip(field.shape, (z, y, x), strict=True))

    def mean(values: NDArray[Any]) -> NDArray[np.float32]:
        blocks = values[: d * z, : h * y, : w * x].reshape(d, z, h, y, w, x)
        return np.asarray(blocks.mean(axis=(1, 3, 5), dtype=np.float32), np.float32)

    spacing = (spacing_um[0] * z, spacing_um[1] * y, spacing_um[2] * x)
    smooth = ndimage.gaussian_filter(mean(field), [NOISE_UM / s for s in spacing])
    return smooth, mean(mask) > 0.5, spacing


def _shift(coarse_um: Triple, spacing_um: Triple) -> Triple:
    """Return the vector from the centre of the first fine voxel to the coarse one's, mm."""
    z, y, x = ((c - f) / 2000 for c, f in zip(coarse_um, spacing_um, strict=True))
    return z, y, x


def _mm(lengths_um: Triple) -> Triple:
    z, y, x = (length / 1000 for length in lengths_um)
    return z, y, x


def _shape(field: NDArray[Any]) -> tuple[int, int, int]:
    z, y, x = field.shape
    return z, y, x


def _largest(mask: Mask) -> Mask:
    labels, count = cc3d.connected_components(mask, connectivity=6, return_N=True)
    if count < 2:
        return mask
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    return np.asarray(labels == sizes.argmax(), np.bool_)


def _touching(mask: Mask, seed: Mask) -> Mask:
    labels, count = cc3d.connected_components(mask | seed, connectivity=6, return_N=True)
    hit = np.zeros(count + 1, np.bool_)
    hit[np.unique(labels[seed])] = True
    hit[0] = False
    return hit[labels]


def _within(mask: Mask, reach_um: float, spacing_um: Triple) -> Mask:
    """Return the mask dilated by a ball, or eroded for a negative reach."""
    import edt

    far = edt.edt(mask if reach_um < 0 else ~mask, anisotropy=spacing_um, black_border=False)
    return np.asarray(far > -reach_um if reach_um < 0 else far <= reach_um, np.bool_)
