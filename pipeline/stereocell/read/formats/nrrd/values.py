"""Interpret NRRD's axis that is not spatial: channels, parts of vectors and tensors, diffusion.

References: https://teem.sourceforge.net/nrrd/format.html#kinds,
https://www.na-mic.org/wiki/NAMIC_Wiki:DTI:Nrrd_format (DWMRI_ fields)
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stereocell.read.diffusion import diffusion_note, order_of
from stereocell.read.image import RGB_COLORS, RGB_NAMES, Color

_PARTS: dict[str, tuple[str, ...]] = {
    "complex": ("real part", "imaginary part"),
    "2-vector": ("x", "y"),
    "3-color": RGB_NAMES,
    "rgb-color": RGB_NAMES,
    "3-vector": ("x", "y", "z"),
    "3-gradient": ("x", "y", "z"),
    "3-normal": ("x", "y", "z"),
    "4-color": (*RGB_NAMES, "Alpha"),
    "rgba-color": (*RGB_NAMES, "Alpha"),
    "quaternion": ("w", "x", "y", "z"),
    "2d-symmetric-matrix": ("xx", "xy", "yy"),
    "2d-masked-symmetric-matrix": ("mask", "xx", "xy", "yy"),
    "3d-symmetric-matrix": ("xx", "xy", "xz", "yy", "yz", "zz"),
    "3d-masked-symmetric-matrix": ("mask", "xx", "xy", "xz", "yy", "yz", "zz"),
}
_VECTORS = ("vector", "covariant-vector", "normal")
_GRADIENT = re.compile(r"DWMRI_gradient_(\d+)")
_MATRIX = re.compile(r"DWMRI_B-matrix_(\d+)")
_B_VALUE = "DWMRI_b-value"


@dataclass(frozen=True, slots=True)
class ValueAxis:
    """The axis of values at each voxel.

    is_time  whether its values count as time points
    order    stored index of each time point
    names    names of channels; None: not stated
    colors   colours of channels, linear RGB, 0..1; None: not stated
    notes    a sentence on the meaning of the values
    """

    is_time: bool = False
    order: tuple[int, ...] = ()
    names: tuple[str | None, ...] = ()
    colors: tuple[Color | None, ...] = ()
    notes: tuple[str, ...] = ()


def value_axis(fields: Mapping[str, Any], kind: str, count: int) -> ValueAxis:
    """Return the meaning of the values along an axis.

    kind   kind of the axis in `kinds`; empty: none is stated
    count  length of the axis
    """
    if count < 2:
        return ValueAxis(names=(None,), colors=(None,))
    weights = _b_values(fields)
    place = "DWMRI_gradient" if any(map(_GRADIENT.fullmatch, fields)) else "DWMRI_B-matrix"
    if len(weights) == count:
        note = diffusion_note(weights, place)
        return ValueAxis(True, tuple(order_of(weights)), (None,), (None,), (note,))
    if str(fields.get("modality", "")).strip().upper() == "DWMRI":
        note = (
            f"{count} images at a place are of diffusion (modality DWMRI) and count as time "
            f"points; {place} states only {len(weights)} of them, so their b-values are not "
            "known; --time picks one"
        )
        return ValueAxis(True, tuple(range(count)), (None,), (None,), (note,))
    names = _PARTS.get(kind.lower(), ())
    if kind.lower() in _VECTORS and count <= len("xyz"):
        names = tuple("xyz"[:count])
    unnamed: tuple[None, ...] = (None,) * count
    is_named = len(names) == count
    stated = f"kind {kind}" if kind not in ("", "none", "???") else "no kind stated"
    shown = f": {', '.join(names)}" if is_named else ""
    note = f"{count} values at each voxel ({stated}) are read as channels{shown}"
    colors = (*RGB_COLORS, None)[:count] if names[: len(RGB_NAMES)] == RGB_NAMES else unnamed
    return ValueAxis(False, (), names if is_named else unnamed, colors, (note,))


def _b_values(fields: Mapping[str, Any]) -> list[float]:
    """Return the b-value of each image, s/mm2; empty: not stated.

    The longest gradient has the stated b-value; those of others grow with the squared length. The
    trace of a B-matrix is the b-value itself.
    """
    matrices = _rows(fields, _MATRIX, 6)
    if matrices:
        return [float(xx + yy + zz) for xx, _, _, yy, _, zz in matrices]
    squared = np.array([float(np.dot(row, row)) for row in _rows(fields, _GRADIENT, 3)])
    try:
        highest = float(fields[_B_VALUE])
    except (KeyError, TypeError, ValueError):
        return []
    if not squared.size or not squared.max() > 0 or not np.isfinite(highest):
        return []
    return [float(one) for one in highest * squared / squared.max()]


def _rows(
    fields: Mapping[str, Any], pattern: re.Pattern[str], numbers: int
) -> list[Sequence[float]]:
    """Return the rows of numbers in numbered fields; empty: the numbers don't count up from 0."""
    found: dict[int, Sequence[float]] = {}
    for name, value in fields.items():
        if (numbered := pattern.fullmatch(name)) is None:
            continue
        try:
            row = [float(part) for part in str(value).split()]
        except ValueError:
            return []
        if len(row) != numbers or not np.isfinite(row).all():
            return []
        found[int(numbered[1])] = row
    return [found[n] for n in sorted(found)] if sorted(found) == list(range(len(found))) else []
