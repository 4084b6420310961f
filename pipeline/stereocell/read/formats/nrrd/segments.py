"""Read the segments of a segmentation that 3D Slicer saved as NRRD (.seg.nrrd).

Keys such as `Segment0_LabelValue`, `Segment0_Name` and `Segment0_Color` state the number, the name
and the colour of each segment. Segments that overlap lie in layers, which become channels here. The
same number means different segments in different layers, so names and colours are then left out.

References: https://slicer.readthedocs.io/en/latest/developer_guide/modules/segmentations.html
"""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from stereocell.model.color import linear_color
from stereocell.model.object_notes import ObjectNotes
from stereocell.read.stated_numbers import numbers_of

_KEY = re.compile(r"Segment([0-9]{1,6})_(ID|LabelValue|Name|Color|Layer)")
_LONGEST = 200  # characters; longer names of segments are cut


def segments_of(fields: Mapping[str, Any]) -> tuple[str, ObjectNotes]:
    """Return the field that says that voxels number objects (empty: none), and notes on them.

    fields  fields of the header, including free keys with values
    """
    segments: dict[str, dict[str, str]] = {}
    for name, value in fields.items():
        if found := _KEY.fullmatch(str(name)):
            segments.setdefault(found[1], {})[found[2]] = str(value).strip()
    if not segments:
        return "", ObjectNotes()
    notes = ObjectNotes()
    layers = {one.get("Layer", "0") for one in segments.values()}
    for one in segments.values() if len(layers) == 1 else ():
        label = one.get("LabelValue", "")
        if not label.isdecimal() or not int(label):
            continue
        if name := " ".join("".join(filter(str.isprintable, one.get("Name", ""))).split()):
            notes.names[int(label)] = name[:_LONGEST]
        color = numbers_of(one.get("Color", "").split())
        if len(color) == 3 and all(0 <= part <= 1 for part in color):
            red, green, blue = (round(255 * part) for part in np.clip(color, 0, 1))
            notes.colors[int(label)] = linear_color((red, green, blue))
    return "segments of 3D Slicer in its header", notes
