"""Read the source's fingerprint from a composed stage, and whether its surfaces have caps."""

import hashlib
import re
from pathlib import Path

from pxr import Sdf, Tf, Usd, UsdUtils

_FINGERPRINT = re.compile(r"[0-9a-f]{16,64}")  # hexadecimal digits, as in provenance.json


def fingerprint_of(stage: Usd.Stage) -> str:
    """Return the fingerprint of the stage's source; empty: no layer states one.

    The layer that a build wrote states it, so a stage with artists' layers has it too. A stage that
    is composed of several builds has a hash of all their fingerprints.
    """
    found = _fingerprints(stage)
    if len(found) < 2:
        return "".join(found)
    return hashlib.sha256(" ".join(found).encode()).hexdigest()


def note_on_source(stage: Usd.Stage, built: Path) -> str:
    """Return a message if a composed stage has another source than a built one; else empty.

    built  stage.usda in the output folder of the bundle
    """
    quiet = UsdUtils.CoalescingDiagnosticDelegate()  # other checks report damaged layers
    try:
        layer = Sdf.Layer.FindOrOpen(str(built))
    except Tf.ErrorException:
        layer = None
    del quiet
    expected, found = _stated_in(layer) if layer else "", _fingerprints(stage)
    if not expected or not found or expected in found:
        return ""
    return (
        f"{stage.GetRootLayer().realPath}: shows another specimen (fingerprint {found[0][:12]}) "
        f"than {built} ({expected[:12]}): the bundle shows the layer's specimen"
    )


def _fingerprints(stage: Usd.Stage) -> list[str]:
    return sorted({text for layer in stage.GetUsedLayers() if (text := _stated_in(layer))})


def has_caps(stage: Usd.Stage) -> bool:
    """Return whether surfaces have caps, which close them at the ends of the built region.

    A stage has caps unless its build's settings, in a layer's custom data, deny it.
    """
    for layer in stage.GetUsedLayers():
        about = layer.customLayerData
        for name in ("stereocell", "settings", "surface", "caps"):
            about = about.get(name) if isinstance(about, dict) else None
        if about is False:
            return False
    return True


def _stated_in(layer: Sdf.Layer) -> str:
    about = layer.customLayerData.get("stereocell", {})
    text = about.get("fingerprint", "") if isinstance(about, dict) else ""
    return text if isinstance(text, str) and _FINGERPRINT.fullmatch(text) else ""
