"""Compare the statements on the voxel spacing in an image of a LIF file.

A dimension states its length between the first and the last voxel, with a unit, which LAS X writes
as m. The scanner's own record repeats the spacing in m. The two differ if a user has recalibrated
the length, or if the stage has moved by another step.
"""

import math
from collections.abc import Sequence
from typing import Any

from stereocell.read.spacing import Triple, um_per
from stereocell.read.statements import Statement, Subject, Trust, settle

_DIMENSIONS = "./Data/Image/ImageDescription/Dimensions/DimensionDescription"
_ID = {"X": "1", "Y": "2", "Z": "3"}  # DimID of each axis
_RECORDED = {"X": ("dblVoxelX",), "Y": ("dblVoxelY",), "Z": ("dblVoxelZ", "dblStepSize")}
_UM_PER_METER = 1e6
_REMEDY = "--spacing-um z,y,x replaces it"
# Relative difference; lengths counted as 200 or more voxels instead of steps differ by less.
_TOLERANCE = 5e-3


def settle_lengths(image: Any) -> tuple[Triple | None, tuple[str, ...]]:
    """Return the spacing (z, y, x), um, and notes; None: not stated along every axis."""
    nodes = {str(node.get("DimID")): node for node in image.xml_element.findall(_DIMENSIONS)}
    found: list[float] = []
    notes: list[str] = []
    for axis in "ZYX":
        node = nodes.get(_ID[axis])
        if node is None:
            return None, ()
        unit = str(node.get("Unit") or "")
        if not unit:
            subject = Subject(f"unit of length along {axis.lower()}", remedy=_REMEDY)
            assumed = settle(subject, [Statement("m", "as in files of LAS X", Trust.ASSUMED)])
            unit, notes = str(assumed.value), [*notes, *assumed.notes]
        steps, per = int(node.get("NumberOfElements", 0)) - 1, um_per(unit)
        first = _number(node.get("Origin"))
        length = abs(first + _number(node.get("Length")) - first)
        if steps < 1 or length == 0 or per is None:
            return None, ()
        statements = [Statement(length / steps * per, "Length of the dimension")]
        if _is_upright(image.dims):
            statements += _recorded(image, axis)
        subject = Subject(f"voxel spacing along {axis.lower()}", "um", _TOLERANCE, _REMEDY)
        settled = settle(subject, statements)
        found.append(settled.number)
        notes += settled.notes
    return (found[0], found[1], found[2]), tuple(notes)


def _is_upright(dims: Sequence[str]) -> bool:
    """Return whether the images are planes of x and y, so that the scanner's axes are theirs."""
    return [axis for axis in dims if axis in "ZYX"] == ["Z", "Y", "X"]


def _recorded(image: Any, axis: str) -> list[Statement]:
    """Return the scanner's statements on the spacing along an axis."""
    records = {
        str(node.get("Identifier")): _number(node.get("Variant"))
        for node in image.xml_element.iter("ScannerSettingRecord")
    }
    return [
        Statement(abs(records[name]) * _UM_PER_METER, f"{name} of the scanner", Trust.REPEATED)
        for name in _RECORDED[axis]
        if records.get(name)
    ]


def _number(text: str | None) -> float:
    """Return a finite number; 0: the text is not one."""
    try:
        number = float(text or "")
    except ValueError:
        return 0.0
    return number if math.isfinite(number) else 0.0
