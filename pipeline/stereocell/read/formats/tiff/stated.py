"""Read metadata of a plain TIFF: spacings, and names and colours of channels, by its writer.

Resolutions in dots per inch are meant for printers and not read: an inch counts only if ImageJ
names it. Texts that a user typed (labels of slices, image names, descriptions) are not read either,
except for names of channels.
"""

import json
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from tifffile import TiffFile, TiffPage

from stereocell.model.color import linear_color
from stereocell.read.formats.tiff.gdal import gdal_scale
from stereocell.read.image import Color
from stereocell.read.repeated_fields import settle_repeats
from stereocell.read.spacing import PartialTriple, um_per
from stereocell.read.stated_numbers import number_of
from stereocell.read.statements import Statement, Subject, Trust, settle
from stereocell.read.value_scale import ValueScale

_CENTIMETRE = 3  # TIFF tag ResolutionUnit
_ESCAPED = re.compile(r"\\u([0-9A-Fa-f]{4})")
_MAX_NAME = 60  # characters; longer texts are not names of channels
# fields of ImageJ's description that are read
_IMAGEJ_FIELDS = {
    "spacing", "unit", "xunit", "yunit", "zunit", "images", "channels", "slices", "frames",
    "c0", "c1", "cf", "vunit",
}  # fmt: skip
_PIXEL = Subject("voxel spacing", "um", 0.01, "--spacing-um z,y,x replaces it")
_STRAIGHT, _NO_FUNCTION = 0, 20  # values of `cf`, the kind of ImageJ's function
_INCH_UM = 25_400.0
_SCREEN_DPI = (72, 96, 100, 150, 200, 300, 600, 1200)  # dots per inch of screens and printers
_NOTHING: PartialTriple = (None, None, None)


@dataclass(frozen=True, slots=True)
class Stated:
    """The metadata of a file's voxels; None: not stated.

    spacing_um  (z, y, x), um
    names       names of channels, maybe of the first ones only
    colors      colours of the same channels, linear RGB, 0..1
    hint        where a missing spacing may be found
    values      rule by which stored numbers become values
    notes       sentences for the user
    """

    spacing_um: PartialTriple = _NOTHING
    names: tuple[str | None, ...] = ()
    colors: tuple[Color | None, ...] = ()
    hint: str = ""
    values: ValueScale = ValueScale()  # noqa: RUF009  (frozen)
    notes: tuple[str, ...] = ()


def stated_by(tiff: TiffFile, page: TiffPage) -> Stated:
    """Return the metadata of an open file; a garbled entry counts as not stated.

    page  first page of the image, whose tags count
    """
    for flag, read in _READERS.items():
        if getattr(tiff, flag):
            stated = read(tiff, page)
            break
    else:
        stated = Stated()
    z, y, x = stated.spacing_um
    place = "ImageJ's unit with the resolution" if tiff.is_imagej else "the program's metadata"
    notes = tag_notes(page, (y, x), place)
    if y is None and x is None:
        _, y, x = _by_tags(page)
    stated = replace(stated, spacing_um=(z, y, x), notes=(*stated.notes, *notes))
    by_gdal = gdal_scale(page)
    if not by_gdal.notes:
        return stated
    values = by_gdal if stated.values.is_plain else stated.values
    return replace(stated, values=values, notes=(*stated.notes, *by_gdal.notes))


def tag_notes(
    page: TiffPage, pixel_um: tuple[float | None, float | None], place: str
) -> tuple[str, ...]:
    """Compare the stated pixel size (y, x) with the tags, if those are per centimetre.

    place  place where `pixel_um` is stated, for notes

    A resolution of screens and printers is stated for any image, and is not compared.
    """
    notes: list[str] = []
    _, *by_tags = _by_tags(page)
    for axis, own, tag in zip("yx", pixel_um, by_tags, strict=True):
        if own and tag and round(_INCH_UM / tag) not in _SCREEN_DPI:
            name = f"the TIFF tag {axis.upper()}Resolution"
            statements = [Statement(own, place), Statement(tag, name, Trust.REPEATED)]
            notes += settle(replace(_PIXEL, name=f"{_PIXEL.name} along {axis}"), statements).notes
    return tuple(notes)


def _imagej(tiff: TiffFile, page: TiffPage) -> Stated:
    meta = _mapping(tiff.imagej_metadata)
    unit = meta.get("unit")
    per = {axis: _um(meta.get(f"{axis}unit", unit)) for axis in "zyx"}
    if unit is None and _resolution_unit(page) == _CENTIMETRE:
        per = dict.fromkeys("zyx", um_per("cm"))
    y, x = (_over(per[axis], _resolution(page, axis)) for axis in "yx")
    z = _times(per["z"], meta.get("spacing"))
    step_notes: tuple[str, ...] = ()
    if z is not None and z < 0:  # the sign is the direction of the stage; ImageJ ignores it too
        z = -z
        step_notes = (
            f"voxel spacing along z: ImageJ states {-z:.5g} um: the planes are read in the order "
            "of the file",
        )
    hint = "ImageJ leaves out a depth of 1" if "spacing" not in meta else ""
    luts = meta.get("LUTs")
    colors = tuple(_lut_color(lut) for lut in luts) if isinstance(luts, list) else ()
    values, notes = _imagej_calibration(meta)
    notes = (*step_notes, *notes, *_label_notes(meta), *_repeat_notes(tiff))
    return Stated((z, y, x), _imagej_names(meta), colors, hint, values, notes)


def _repeat_notes(tiff: TiffFile) -> tuple[str, ...]:
    """Return a note for each field of ImageJ's description whose lines disagree."""
    pairs = (line.partition("=") for line in tiff.pages.first.description.splitlines())
    known = [(key.strip(), text.strip()) for key, _, text in pairs if key.strip() in _IMAGEJ_FIELDS]
    return settle_repeats(known, "ImageJ's description")[1]


def _imagej_calibration(meta: Mapping[str, Any]) -> tuple[ValueScale, tuple[str, ...]]:
    """Return the scale of ImageJ's values, and notes. `cf` is the kind of function."""
    # ImageJ reads factors without a function as a straight line.
    kind = meta.get("cf", _STRAIGHT if {"c0", "c1"} <= meta.keys() else None)
    if kind is None or kind == _NO_FUNCTION:
        return ValueScale(), ()
    factors = [_times(1.0, meta.get(name)) for name in ("c0", "c1")]
    intercept, slope = factors
    unit = _name(meta.get("vunit", "")) or "values"
    if kind != _STRAIGHT or intercept is None or not slope:
        note = (
            f"values: ImageJ's calibration ({unit}) is not a straight line: the voxels are read as "
            "stored"
        )
        return ValueScale(), (note,)
    if (intercept, slope) == (0.0, 1.0):
        return ValueScale(), ()
    note = (
        f"values: ImageJ's calibration {intercept:g} + {slope:g} * stored number ({unit}) is "
        "applied"
    )
    return ValueScale(slope=slope, intercept=intercept), (note,)


def _imagej_names(meta: Mapping[str, Any]) -> tuple[str | None, ...]:
    """Return the labels that all planes of a channel share, which are names of channels.

    Other labels describe slices, often by a file's name.
    """
    labels, channels = meta.get("Labels"), meta.get("channels", 1)
    if not isinstance(labels, list) or not isinstance(channels, int) or channels < 2:
        return ()
    order = str(meta.get("order", "czt")).lower()
    if order not in ("czt", "ctz", "default") or len(labels) < channels:
        return ()
    shared = [set(labels[index::channels]) for index in range(channels)]
    if any(len(names) > 1 for names in shared):
        return ()
    names = [_name(next(iter(names))) for names in shared]
    return tuple(names) if len(set(names)) == channels else ()


def _label_notes(meta: Mapping[str, Any]) -> tuple[str, ...]:
    """Return a note if Bio-Formats' labels name channels or times that the header lacks."""
    labels = meta.get("Labels")
    if not isinstance(labels, list) or not labels:
        return ()
    named = []
    for letter, key, noun in (("c", "channels", "channels"), ("t", "frames", "time points")):
        found = [re.match(rf"(?:.*\s)?{letter}:(\d+)/(\d+)\b", str(text)) for text in labels]
        if not all(found):
            continue
        numbers = {int(one[1]) for one in found if one is not None}
        if len(numbers) > 1 and meta.get(key, 1) == 1:
            named.append(f"{len(numbers)} {noun}")
    if not named:
        return ()
    return (
        f"the labels of the slices name {' and '.join(named)}, which the header of ImageJ counts "
        "as slices: they are read as slices (correct the file by *Stack to Hyperstack* in "
        "ImageJ)",
    )


def _lut_color(lut: Any) -> Color | None:
    """Return the colour of the brightest value; None for a grey one."""
    table = np.asarray(lut)
    if table.shape[0] != 3 or table.ndim != 2:
        return None
    red, green, blue = (int(value) for value in table[:, -1])
    return None if red == green == blue else linear_color((red, green, blue))


def _lsm(tiff: TiffFile, page: TiffPage) -> Stated:
    meta = _mapping(tiff.lsm_metadata)
    z, y, x = (_times(1e6, meta.get(f"VoxelSize{axis}")) for axis in "ZYX")  # from m to um
    channels = _mapping(meta.get("ChannelColors"))
    names = tuple(_name(name) for name in channels.get("ColorNames") or ())
    colors = tuple(_rgb(color) for color in channels.get("Colors") or ())
    return Stated((z, y, x), names, colors)


def _stk(tiff: TiffFile, page: TiffPage) -> Stated:
    meta = _mapping(tiff.stk_metadata)
    per = _um(meta.get("CalibrationUnits")) if meta.get("SpatialCalibration", 1) else None
    y, x = (_times(per, meta.get(f"{axis}Calibration")) for axis in "YX")
    steps = np.abs(np.atleast_1d(np.asarray(meta.get("ZDistance", ()), np.float64)))
    steps = steps[np.isfinite(steps) & (steps > 0)]
    z = float(np.median(steps)) if steps.size else None  # um, regardless of the calibration's unit
    return Stated((z, y, x))


def _metaseries(tiff: TiffFile, page: TiffPage) -> Stated:
    plane = _mapping(_mapping(tiff.metaseries_metadata).get("PlaneInfo"))
    is_set = plane.get("spatial-calibration-state", False)
    per = _um(plane.get("spatial-calibration-units")) if is_set else None
    y, x = (_times(per, plane.get(f"spatial-calibration-{axis}")) for axis in "yx")
    return Stated((None, y, x))


def _micromanager(tiff: TiffFile, page: TiffPage) -> Stated:
    summary = _mapping(_mapping(tiff.micromanager_metadata).get("Summary"))
    side = _times(1.0, summary.get("PixelSize_um") or None)  # 0 means that no size was calibrated
    z = _times(1.0, summary.get("z-step_um") or None)
    names = summary.get("ChNames")
    return Stated((z, side, side), tuple(map(_name, names)) if isinstance(names, list) else ())


def _scanimage(tiff: TiffFile, page: TiffPage) -> Stated:
    frame = _mapping(_mapping(tiff.scanimage_metadata).get("FrameData"))
    step = frame.get("SI.hStackManager.stackZStepSize")
    return Stated((_times(1.0, step or None), None, None))


def _shaped(tiff: TiffFile, page: TiffPage) -> Stated:
    """Read tifffile's own JSON; a caller of `imwrite` may have added ImageJ's fields."""
    try:  # each image of a file has its own description
        meta = _mapping(json.loads(page.description))
    except (ValueError, RecursionError):
        meta = {}
    per = _um(meta.get("unit"))
    z = _times(per, meta.get("spacing"))
    # the tag then states the unit of the resolution itself
    if _resolution_unit(page) == _CENTIMETRE:
        return Stated((z, None, None))
    y, x = (_over(per, _resolution(page, axis)) for axis in "yx")
    return Stated((z, y, x))


# tifffile's flag for a kind of file -> reader of its metadata; the first flag that is set counts
_READERS: dict[str, Callable[[TiffFile, TiffPage], Stated]] = {
    "is_lsm": _lsm,
    "is_stk": _stk,
    "is_metaseries": _metaseries,
    "is_imagej": _imagej,
    "is_micromanager": _micromanager,
    "is_scanimage": _scanimage,
    "is_shaped": _shaped,
}


def _by_tags(page: TiffPage) -> PartialTriple:
    """Return y and x if the tags state them per centimetre."""
    per = um_per("cm") if _resolution_unit(page) == _CENTIMETRE else None
    y, x = (_over(per, _resolution(page, axis)) for axis in "yx")
    return None, y, x


def _resolution_unit(page: TiffPage) -> int:
    return int(page.tags.valueof("ResolutionUnit", default=0))


def _resolution(page: TiffPage, axis: str) -> float | None:
    """Return the pixels per unit along y or x."""
    value = page.tags.valueof(f"{axis.upper()}Resolution")
    if not isinstance(value, tuple) or len(value) != 2 or not value[0] or not value[1]:
        return None
    return float(value[0]) / float(value[1])


def _um(unit: Any) -> float | None:
    """Return a unit in um. ImageJ writes the micro sign of `um` as an ASCII escape."""
    if not isinstance(unit, str):
        return None
    text = _ESCAPED.sub(lambda found: chr(int(found[1], 16)), unit)
    # U+00C2 is the first byte of UTF-8's micro sign
    return um_per(text.replace("\u00c2", "").strip())


def _times(per: float | None, value: Any) -> float | None:
    if per is None or isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return per * number_of(value) if math.isfinite(number_of(value)) else None


def _over(per: float | None, resolution: float | None) -> float | None:
    return None if per is None or not resolution else per / resolution


def _mapping(value: Any) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}


def _name(text: Any) -> str | None:
    name = " ".join(str(text).split())
    return name if 0 < len(name) <= _MAX_NAME else None


def _rgb(color: Any) -> Color | None:
    try:
        red, green, blue = (int(value) & 0xFF for value in list(color)[:3])
    except (TypeError, ValueError, OverflowError):
        return None
    return None if red == green == blue else linear_color((red, green, blue))
