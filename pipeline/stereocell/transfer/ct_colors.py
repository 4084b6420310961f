"""The tissues of a CT in the colours that a physician knows from an atlas.

This is a 2D function of bands of Hounsfield units. Fat is yellow. Soft tissue is red, and lighter
if it is denser, so that organs differ on a cut. Bone has the channel's own light colour, and
vessels with contrast medium are light red.

An edge to air is skin with any values: half-way from air to muscle lies the value of fat.
So the bands of fat and soft tissue cover only small gradients. Skin, in the channel's colour like
the surface, covers large ones.
"""

from stereocell.model.channel import Shape, Shapes
from stereocell.transfer.ct_tissues import TISSUES

NAME = "tissues"
# Linear RGB as factors to the channel's colour, and Hounsfield units. Neighbouring bands share
# their ends, which _SOFT_HU blurs.
_SKIN = (1.0, 1.0, 1.0)
_FAT = (1.0, 0.92, 0.58)
# Soft tissue by its upper end in Hounsfield units: fluid, organs, muscle and blood, and tissue that
# takes up contrast medium
_SOFT_TISSUE = (
    (10.0, (0.5, 0.2, 0.2)),
    (45.0, (0.63, 0.28, 0.29)),
    (80.0, (0.78, 0.36, 0.38)),
    (TISSUES["soft_tissue"][1], (0.92, 0.48, 0.5)),
)
_CONTRAST = (0.97, 0.5, 0.48)
_BONE = (1.0, 1.0, 1.0)
_SOFT_HU = 40.0  # Hounsfield units over which neighbouring bands blend
_AIR_STEP_HU = 220.0  # Hounsfield units; least step over two voxels of an edge to air
# Hounsfield units at which fat's band begins; below it, skin has such values when it is blurred
_FAT_FROM_HU = -150.0
# Largest ratio of the coarsest to the finest voxel spacing. Across thicker slices an edge to air is
# as flat as one between tissues.
MAX_UNEVEN = 3.0
_FOOT_HU = 36.0  # Hounsfield units below the surface at which opacity begins
# Share of the light absorbed along one finest voxel spacing. Skin hides the fat beneath it.
_OPACITY, _SKIN_OPACITY, _BONE_OPACITY = 0.45, 0.95, 0.6


def tissue_shapes(level: float, window: tuple[float, float], gradient_max: float) -> Shapes:
    """Return a shape for each tissue's band of values that lies in a window.

    level         iso-value of the surface, Hounsfield units
    window        Hounsfield units that become 0 and 1
    gradient_max  step, as a share of the window, whose gradient is 1
    """
    fat, muscle, bone = (TISSUES[name] for name in ("fat", "soft_tissue", "bone"))
    first = level - _FOOT_HU
    step = min(_AIR_STEP_HU / (window[1] - window[0]) / gradient_max, 0.9)
    starts = (fat[1], *(end for end, _ in _SOFT_TISSUE[:-1]))
    bands = (
        (first, _FAT_FROM_HU, (0.0, 1.0), _SKIN, _SKIN_OPACITY),
        (_FAT_FROM_HU, fat[1], (0.0, step), _FAT, _OPACITY),
        *(
            (start, end, (0.0, step), color, _OPACITY)
            for start, (end, color) in zip(starts, _SOFT_TISSUE, strict=True)
        ),
        (_FAT_FROM_HU, muscle[1], (step, 1.0), _SKIN, _SKIN_OPACITY),
        (muscle[1], bone[0], (0.0, 1.0), _CONTRAST, _OPACITY),
        (bone[0], bone[1], (0.0, 1.0), _BONE, _BONE_OPACITY),
    )
    return tuple(
        shape
        for low, high, gradients, color, opacity in bands
        if (shape := _band((max(low, first), high), window, gradients, color, opacity)) is not None
    )


def _band(
    ends_hu: tuple[float, float],
    window: tuple[float, float],
    gradients: tuple[float, float],
    color: tuple[float, float, float],
    opacity: float,
) -> Shape | None:
    """Return a band that overlaps its neighbours by _SOFT_HU; None if it is outside the window."""
    low, high = window
    first, last = ends_hu[0] - _SOFT_HU / 2, ends_hu[1] + _SOFT_HU / 2
    values = tuple(min(max((hu - low) / (high - low), 0.0), 1.0) for hu in (first, last))
    if values[1] - values[0] < 1e-3:
        return None
    return Shape(
        kind="rectangle",
        values=(values[0], values[1]),
        gradients=gradients,
        tip=0.5,
        color=color,
        opacity=opacity,
        softness=min(2 * _SOFT_HU / (last - first), 1.0),
    )
