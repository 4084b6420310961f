"""Read NRRD: .nrrd, and .nhdr with its voxels in a file beside it. pynrrd reads the fields.

If `space` names anatomical axes, the image lies in the patient, in mm unless `space units` states
otherwise. Without it (Fiji, CMTK) the image is a stack: x, y, z as stored, with the spacing in
`space units`. The voxels are read by file_array.py, because pynrrd's `read_data` reads the whole
file, and opens a file of voxels anywhere on the machine. Comments and `key:=value` pairs may
identify a patient.

References: https://teem.sourceforge.net/nrrd/format.html
"""

import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import nrrd
import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.read.dataset import StoredArray, VoxelArray
from stereocell.read.file_array import FileArray, PackedArray, notes_on_rest, unpack_array
from stereocell.read.formats.nrrd.labels import (
    labelled_axes,
    names_by_labels,
    notes_beside_directions,
)
from stereocell.read.formats.nrrd.segments import segments_of
from stereocell.read.formats.nrrd.statements import (
    axis_lengths,
    kind_notes,
    length_notes,
    units_um,
    value_notes,
)
from stereocell.read.formats.nrrd.values import ValueAxis, value_axis
from stereocell.read.image import MAX_CHANNELS, Image
from stereocell.read.ordered_array import OrderedArray
from stereocell.read.patient_grid import place, settle_origin
from stereocell.read.plausible_size import size_notes
from stereocell.read.spacing import Grid, PartialTriple, grid_of
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location, require_own

NAME = "NRRD"
_MAX_HEADER = 1 << 20  # bytes of a file that are searched for the header
_LIST = re.compile(rb"^data ?file:\s*LIST\b.*$", re.MULTILINE | re.IGNORECASE)
_MAX_LINES = 10_000  # lines before the voxels that are skipped at most (field `line skip`)
_TYPES = {
    "i1": ("signed char", "int8", "int8_t"),
    "u1": ("uchar", "unsigned char", "uint8", "uint8_t"),
    "i2": ("short", "short int", "signed short", "signed short int", "int16", "int16_t"),
    "u2": ("ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"),
    "i4": ("int", "signed int", "int32", "int32_t"),
    "u4": ("uint", "unsigned int", "uint32", "uint32_t"),
    "i8": ("longlong", "long long", "long long int", "signed long long", "int64", "int64_t"),
    "u8": ("ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"),
    "f4": ("float",),
    "f8": ("double",),
}
_PACKINGS = {"gzip": "gzip", "gz": "gzip", "bzip2": "bzip2", "bz2": "bzip2"}
_SIDES = {"left": (0, 1), "right": (0, -1), "posterior": (1, 1), "anterior": (1, -1)}
_SIDES |= {"superior": (2, 1), "inferior": (2, -1)}  # word -> (axis of LPS, sign)
_SHORT = {"LPS": "left-posterior-superior", "LAS": "left-anterior-superior"}
_SHORT |= {"RAS": "right-anterior-superior", "RPS": "right-posterior-superior"}
_IN_MM = ("scanner-xyz", "scanner-xyz-time")


def read_image(location: Location) -> Image:
    """Return the image of the file, with all its time points. Raises SourceError."""
    where = location.shown
    fields, end = _header(location)
    shape = [int(n) for n in np.atleast_1d(fields["sizes"])]
    labelled = labelled_axes(fields, shape)
    directions = _directions(where, fields, shape, labelled)
    names = _axes(where, fields, shape, directions, labelled)
    sizes = [shape[names.index(axis)] for axis in "ijk"]
    if (count := shape[names.index("c")] if "c" in names else 1) > MAX_CHANNELS:
        raise SourceError(f"{where}: sizes: found {count} values, expected at most {MAX_CHANNELS}")
    stored: StoredArray = _array(location, fields, end, shape[::-1])
    array, names, values = _with_values(fields, stored, names)
    axes = tuple(reversed(names))
    at = [names.index(axis) for axis in "ijk"]
    to_lps, files = _to_lps(where, fields), _files(location, fields)
    factors, unit_notes = units_um(fields, at, is_patient=to_lps is not None)
    spatial = directions[at] * factors  # um
    labels, objects = segments_of(fields)
    notes = (
        *length_notes(fields, shape, directions, at),
        *kind_notes(fields, at),
        *unit_notes,
        *value_notes(fields),
        *values.notes,
        *notes_on_rest(stored),
    )
    if to_lps is None:
        voxels, grid, stack_notes = _stacked(fields, array, names, directions, spatial)
        notes = (*notes, *stack_notes)
        return Image(
            (voxels,), (grid,), values.names, values.colors, 1, notes=notes, files=files,
            labels=labels, objects=objects,
        )  # fmt: skip
    affine = np.eye(4)
    affine[:3, :3] = to_lps @ spatial.T / 1000.0
    stated = fields.get("space origin")
    origin, origin_notes = settle_origin(
        "space origin", None if stated is None else np.ravel(stated).tolist()
    )
    affine[:3, 3] = to_lps @ (origin * factors.max(axis=0)) / 1000.0
    label_notes = notes_beside_directions([labelled[index] for index in at if labelled], affine)
    notes = (
        *notes,
        *origin_notes,
        *label_notes,
        *size_notes(np.linalg.norm(affine[:3, :3], axis=0).tolist(), sizes),
    )
    image = place(where, array, axes, affine, "space directions").image(
        NAME, notes=notes, has_sides=_names_sides(fields)
    )
    if len(values.names) > 1:
        image = replace(image, names=values.names, colors=values.colors)
    return replace(image, files=files, labels=labels, objects=objects)


def _with_values(
    fields: Mapping[str, Any], array: StoredArray, names: list[str]
) -> tuple[StoredArray, list[str], ValueAxis]:
    """Return the voxels and the names of the axes (fastest first), with the axis of values."""
    if "c" not in names:
        return array, names, ValueAxis(names=(None,), colors=(None,))
    index = names.index("c")
    at = len(names) - 1 - index
    kind = str([*fields.get("kinds", ()), *[""] * len(names)][index])
    values = value_axis(fields, kind, array.shape[at])
    if values.is_time and "t" in names:
        unnamed = (None,) * array.shape[at]
        return array, names, replace(values, names=unnamed, colors=unnamed)
    if not values.is_time:
        return array, names, values
    if list(values.order) != sorted(values.order):
        array = OrderedArray(array, at, values.order)
    return array, ["t" if name == "c" else name for name in names], values


def _stacked(
    fields: Mapping[str, Any], array: StoredArray, names: Sequence[str],
    directions: NDArray[np.float64], spatial: NDArray[np.float64],
) -> tuple[VoxelArray, Grid, tuple[str, ...]]:  # fmt: skip
    """Return the voxels of a stack that is not placed in a patient, their grid, and notes.

    names    names of the axes, fastest first
    spatial  rows of `directions` for i, j, k, in um
    """
    shape = [int(n) for n in fields["sizes"]]
    stacked, notes = names_by_labels(names, labelled_axes(fields, shape), shape)
    voxels = VoxelArray(array, tuple(reversed(stacked)))
    at = [names.index(axis) for axis in "ijk"]
    rows = [at.index(stacked.index(axis)) for axis in "xyz"]
    grid = grid_of(voxels.shape, _spacing(spatial[rows]))
    return voxels, grid, (*notes, *_turned(fields, directions[at][rows]))


def _header(location: Location) -> tuple[Mapping[str, Any], int]:
    """Return the fields and the length of the header, including the empty line, in bytes."""
    where = location.shown
    with one_line(where, f"an {NAME} file (.nrrd, .nhdr)"), open(location.path, "rb") as file:
        content = file.read(_MAX_HEADER)
        if not content.startswith(b"NRRD"):
            raise ValueError("no `NRRD` at the start")
        blank = re.search(rb"\n\r?\n", content)
        head = content[: blank.start()] if blank else content
        if listed := _LIST.search(head):
            head = head[: listed.end()]  # the lines after `data file: LIST` are file names
        fields = nrrd.read_header([f"{line}\n" for line in head.decode("latin-1").splitlines()])
        missing = {"sizes", "type", "encoding"} - set(fields)
        if missing:
            raise KeyError(min(missing))
        fields["sizes"] = np.atleast_1d(fields["sizes"])
        if min(fields["sizes"]) < 1 or len(fields["sizes"]) != fields["dimension"]:
            raise ValueError(f"sizes: {fields['sizes'].tolist()}")
    return fields, blank.end() if blank else len(content)


def _directions(
    where: str, fields: Mapping[str, Any], shape: Sequence[int], labelled: Sequence[str]
) -> NDArray[np.float64]:
    """Return a row of the directions for each axis, (n, 3); NaN: an axis without a direction.

    labelled  result of `labelled_axes`
    """
    stated = fields.get("space directions")
    found = np.full((len(shape), 3), np.nan)
    # Only lengths are stated. If `kinds` and labels name no axes of space, the first three axes
    # with a length count as them.
    if stated is None:
        lengths = axis_lengths(fields, shape)
        kinds = list(fields.get("kinds", ()))
        known = [i for i, kind in enumerate(kinds[: len(shape)]) if kind in ("domain", "space")]
        count = len(shape)
        if not known and set("xyz") <= set(labelled):
            known = [i for i in range(count) if labelled[i] in tuple("xyz")]
        known = known or [i for i in range(count) if np.isfinite(lengths[i]) or count == 3]
        for row, index in enumerate(known[:3]):
            found[index] = 0.0
            found[index, row] = lengths[index] if np.isfinite(lengths[index]) else 0.0
        return found
    rows = [np.ravel(row) if row is not None else [np.nan] * 3 for row in stated]
    if len(rows) != len(shape) or any(len(row) != 3 for row in rows):
        raise SourceError(
            f"{where}: space directions: found {len(rows)} of {sorted({len(r) for r in rows})} "
            f"numbers, expected {len(shape)} of 3"
        )
    return np.array(rows, float)


def _axes(
    where: str, fields: Mapping[str, Any], shape: Sequence[int], directions: NDArray[np.float64],
    labelled: Sequence[str],
) -> list[str]:  # fmt: skip
    """Return the names of the axes, fastest first: i, j, k of space, t and c."""
    spatial = [index for index in range(len(shape)) if np.isfinite(directions[index]).all()]
    if len(spatial) != 3:
        raise SourceError(
            f"{where}: sizes {list(shape)}: found {len(spatial)} axes of space, expected 3 by "
            "`space directions`, `spacings` or `kinds` (a volume needs at least 2 planes)"
        )
    kinds = list(fields.get("kinds", ())) + [""] * len(shape)
    names = [f"single{index}" for index in range(len(shape))]
    for name, index in zip("ijk", spatial, strict=True):
        names[index] = name
    for index in set(range(len(shape))) - set(spatial):
        is_time = str(kinds[index]) == "time" or (labelled and labelled[index] == "t")
        name = "t" if is_time else "c"
        if name in names and shape[index] > 1:
            raise SourceError(
                f"{where}: kinds: found {kinds[: len(shape)]}, expected at most one axis of time "
                "and one of values, beside those of space"
            )
        if name not in names:
            names[index] = name
    return names


def _names_sides(fields: Mapping[str, Any]) -> bool:
    """Return whether the space names the patient's sides; a scanner's own space doesn't."""
    return all(word in _SIDES for word in _words(fields))


def _words(fields: Mapping[str, Any]) -> list[str]:
    """Return the directions of the axes of the file's space: `left`, `posterior`, `superior`."""
    space = str(fields.get("space", ""))
    return _SHORT.get(space.upper()[:3], space).lower().removesuffix("-time").split("-")


def _to_lps(where: str, fields: Mapping[str, Any]) -> NDArray[np.float64] | None:
    """Return the matrix (3, 3) from the file's space to LPS; None: it names no anatomical axes."""
    space = str(fields.get("space", ""))
    words = _words(fields)
    if not all(word in _SIDES for word in words):
        return np.eye(3) if space.lower() in _IN_MM else None
    matrix = np.zeros((3, 3))
    for column, word in enumerate(words):
        axis, sign = _SIDES[word]
        matrix[axis, min(column, 2)] += sign
    if len(words) != 3 or abs(np.linalg.det(matrix)) != 1:
        raise SourceError(f"{where}: space: found {space!r:.60}, expected three axes of the body")
    return matrix


def _spacing(spatial: NDArray[np.float64]) -> PartialTriple:
    """Return the lengths (z, y, x) of directions in um; None: not stated, or without a unit."""
    lengths = np.linalg.norm(spatial, axis=1)
    x, y, z = (float(n) if np.isfinite(n) and n > 0 else None for n in lengths)
    return z, y, x


def _turned(fields: Mapping[str, Any], spatial: NDArray[np.float64]) -> tuple[str, ...]:
    """Note directions that are not along x, y, z: outside a patient they are not applied."""
    notes = []
    is_along_axes = np.array_equal(spatial, np.diag(np.abs(np.diag(spatial))))
    if fields.get("space directions") is not None and not is_along_axes:
        notes.append(
            "`space directions` rotate or mirror the axes: not applied, the voxels stay as stored"
        )
    if any(step < 0 for step in np.atleast_1d(fields.get("spacings", ()))):
        stated = " ".join(f"{step:g}" for step in fields["spacings"])
        notes.append(
            f"spacings: found {stated}, one of which is negative: its sign is ignored and the "
            "voxels stay as stored, so the volume may be mirrored"
        )
    if "left-handed" in str(fields.get("space", "")).lower():
        notes.append(
            "space: the axes are left-handed: the voxels stay as stored, so the volume may be "
            "mirrored"
        )
    return tuple(notes)


def _files(location: Location, fields: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the path of the header, and that of a separate file of voxels."""
    named = fields.get("data file", fields.get("datafile"))
    if named is None:
        return (location.path,)
    return location.path, os.path.join(os.path.dirname(os.path.realpath(location.path)), str(named))


def _array(
    location: Location, fields: Mapping[str, Any], end: int, shape: Sequence[int]
) -> StoredArray:
    """Return the voxels, which follow the header or lie in a file beside it."""
    where, stated = location.shown, str(fields["type"])
    kind = next((kind for kind, names in _TYPES.items() if stated in names), None)
    if kind is None:
        raise SourceError(f"{where}: type: found {stated!r:.40}, expected whole or real numbers")
    endian = fields.get("endian", "little" if kind.endswith("1") else None)
    if endian not in ("little", "big"):
        raise SourceError(f"{where}: endian: found {endian!r:.40}, expected little or big")
    dtype = np.dtype((">" if endian == "big" else "<") + kind)
    path = os.path.realpath(location.path)
    named = fields.get("data file", fields.get("datafile"))
    if named is not None:
        if str(named).upper().startswith("LIST") or "%" in str(named):
            raise SourceError(
                f"{where}: data file: found a list of files, expected one: save it again as .nrrd"
            )
        path, end = os.path.join(os.path.dirname(path), str(named)), 0
        where = f"{where}: data file {str(named)!r:.200}"
        require_own(path, [location.folder], named=where)
        if not Path(path).is_file():
            raise SourceError(f"{where}: not found, expected the voxels beside the header")
    skip = int(fields.get("byte skip", fields.get("byteskip", 0)))
    end = _after_lines(path, end, int(fields.get("line skip", fields.get("lineskip", 0))))
    encoding = str(fields["encoding"]).lower()
    if encoding == "raw":
        if skip < 0:  # the voxels are then the last bytes of the file
            end, skip = max(0, os.path.getsize(path) - math.prod(shape) * dtype.itemsize), 0
        return FileArray(path, shape, dtype, end + skip, where)
    if encoding not in _PACKINGS or skip < 0:
        raise SourceError(
            f"{where}: encoding: found {encoding!r:.40}, byte skip {skip}, expected raw, gzip or "
            "bzip2: save it again"
        )
    load = partial(unpack_array, path, shape, dtype, _PACKINGS[encoding], end, skip=skip)
    return PackedArray(shape, dtype, load)


def _after_lines(path: str, start: int, count: int) -> int:
    """Return the position in a file after some lines, in bytes."""
    if count <= 0:
        return start
    with open(path, "rb") as file:
        file.seek(start)
        for _ in range(min(count, _MAX_LINES)):
            file.readline(_MAX_HEADER)
        return file.tell()
