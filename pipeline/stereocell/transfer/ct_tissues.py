"""Transfer functions of CT by tissue. Each shows the published Hounsfield units of one tissue.

References
G. N. Hounsfield, "Computed medical imaging", Medical Physics 7, 1980. doi:10.1118/1.594709 (air at
-1000, water at 0, dense bone from 250 up)
J. Aubrey et al., "Measurement of skeletal muscle radiation attenuation and basis of its biological
variation", Acta Physiologica 210, 2014. doi:10.1111/apha.12224 (fat -190 to -30, muscle -29 to 150)
P. F. J. New & S. Aronow, "Attenuation measurements of whole blood and blood fractions in computed
tomography", Radiology 121, 1976. doi:10.1148/121.3.635 (whole blood to retracted clot, 40 to 90)
"""

from collections.abc import Collection

from stereocell.model.channel import OpacityPoints

TISSUES: dict[str, tuple[float, float]] = {
    "air": (-1024.0, -900.0),
    "fat": (-190.0, -30.0),
    "soft_tissue": (-29.0, 150.0),
    "blood": (40.0, 90.0),
    "bone": (250.0, 3071.0),
}
_OPACITY = {"air": 0.05, "fat": 0.3, "soft_tissue": 0.25, "blood": 0.5, "bone": 0.8}
BONE = "bone"
BONE_LEVEL_HU = 150.0  # least level of a surface that counts as bone; soft tissue ends there
_SOFT_HU = 10.0  # Hounsfield units over which opacity rises


def opening_function(level: float | None, functions: Collection[str]) -> str | None:
    """Return the tissue whose function suits a surface best, or None for the general function.

    level      iso-value of the surface, Hounsfield units; None: there is no surface
    functions  names of the available functions
    """
    is_bone = level is not None and level >= BONE_LEVEL_HU
    return BONE if is_bone and BONE in functions else None


def tissue_functions(window: tuple[float, float]) -> dict[str, OpacityPoints]:
    """Return the opacity points of each tissue that lies in a window, by its name.

    window  Hounsfield units that become 0 and 1
    """
    low, high = window
    functions: dict[str, OpacityPoints] = {}
    for name, (first, last) in TISSUES.items():
        if last <= low or first >= high:
            continue
        top = _OPACITY[name]
        hu = ((first - _SOFT_HU, 0.0), (first, top), (last, top), (last + _SOFT_HU, 0.0))
        places = [(min(max((at - low) / (high - low), 0.0), 1.0), opacity) for at, opacity in hu]
        # A tissue that continues beyond the window is shown up to the window's end.
        start = (0.0, top if first <= low else 0.0)
        end = (1.0, top if last >= high else 0.0)
        inner = [point for point in places if 0.0 < point[0] < 1.0]
        functions[name] = (start, *inner, end)
    return functions
