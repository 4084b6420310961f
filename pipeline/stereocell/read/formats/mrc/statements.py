"""Compare the statements in an MRC header on the voxel spacing and on the sign of bytes.

The spacing is the length of the cell divided by its sampling (`mx`, `my`, `mz`). Some writers leave
an old sampling in the header, such as that of the stack from which a part was cut. So the spacing
is compared with the length divided by the number of voxels. Bytes of mode 0 are signed in MRC2014
and were unsigned in IMOD and older programs. IMOD's flag, the range of the densities and the
version of the format decide.
"""

from typing import Any

import numpy as np
from mrcfile.dtypes import get_ext_header_dtype

from stereocell.read.spacing import Triple
from stereocell.read.statements import Statement, Subject, Trust, settle

_UM_PER_ANGSTROM = 1e-4
_ANGSTROM_PER_M = 1e10
_LARGEST_PIXEL_M = 1e-3  # m; a larger number is damage
_IMOD_STAMP = 1146047817
_SIGNED_FLAG = 1  # bit of IMOD's flags
_FIRST_OF_2014 = 20140  # first `nversion` of MRC2014
_LARGEST_SIGNED = 127
_AXES = "zyx"
_ORDER = Subject("axes of columns, rows and sections (MAPC, MAPR, MAPS)")
_SIGN = Subject("bytes of mode 0")
_RIGHT_ANGLE = 90.0  # degrees
_MIN_SKEW = 0.01  # degrees; a smaller difference is due to rounding
STACK_OF_VOLUMES = 401  # space group


def settle_spacing(
    header: Any, extended: Any, *, is_stack: bool
) -> tuple[Triple | None, tuple[str, ...]]:
    """Return the spacing (z, y, x), um, and notes; None: the header states no cell or sampling.

    extended  bytes of the extended header; None: there are none
    is_stack  whether the header states a stack of images, which has an `mz` of 1
    """
    cell = [float(header["cella"][axis]) for axis in _AXES]
    counts = [int(header[f"m{axis}"]) for axis in _AXES]
    if min(counts) < 1 or min(cell) <= 0:
        return None, ()
    sizes = _sizes(header)
    found: list[float] = []
    notes: list[str] = []
    of_camera = _camera_spacing(header, extended)
    if is_stack and counts[0] == 1 and _is_like_pixels(cell, counts):
        sizes[0] = 1
    for axis, length, count, size in zip(_AXES, cell, counts, sizes, strict=True):
        subject = Subject(
            f"voxel spacing along {axis}", "Angstrom", remedy="--spacing-um z,y,x replaces it"
        )
        statements = [Statement(length / count, f"cella.{axis} by m{axis} {count}")]
        statements.append(Statement(length / size, f"cella.{axis} by {size} voxels", Trust.DERIVED))
        if axis in of_camera:
            place = "the pixel size in FEI's extended header"
            statements.append(Statement(of_camera[axis], place, Trust.REPEATED))
        settled = settle(subject, statements)
        found.append(settled.number * _UM_PER_ANGSTROM)
        notes += settled.notes
    if all(length == count for length, count in zip(cell, counts, strict=True)):
        notes.append(
            "voxel spacing: found exactly 1 Angstrom along all axes, which programs write if they "
            "know no spacing: is it correct? (--spacing-um z,y,x replaces it)"
        )
    z, y, x = found
    return (z, y, x), tuple(notes)


def _is_like_pixels(cell: list[float], counts: list[int]) -> bool:
    """Return whether the step along z is like the width of the pixels, up to a factor of 10."""
    step, *wide = (length / count for length, count in zip(cell, counts, strict=True))
    return min(wide) / 10 <= step <= max(wide) * 10


def _camera_spacing(header: Any, extended: Any) -> dict[str, float]:
    """Return the pixel size along x and y, Angstrom, from FEI's extended header; {}: none."""
    if extended is None or bytes(header["exttyp"]) not in (b"FEI1", b"FEI2"):
        return {}
    order = header.dtype["nx"].str[0].replace("|", "=")
    kind = get_ext_header_dtype(bytes(header["exttyp"]), order)
    raw = np.asarray(extended).tobytes()
    if len(raw) < kind.itemsize:
        return {}
    first = np.frombuffer(raw[: kind.itemsize], kind)[0]
    if int(first["Metadata size"]) != kind.itemsize:
        return {}
    sizes = {axis: float(first[f"Pixel size {axis.upper()}"]) for axis in "xy"}
    return {
        axis: size * _ANGSTROM_PER_M for axis, size in sizes.items() if 0 < size < _LARGEST_PIXEL_M
    }


def _sizes(header: Any) -> list[int]:
    """Return the voxels along z, y and x of the cell, in any order of axes in the file."""
    order = [int(header[name]) for name in ("mapc", "mapr", "maps")]
    if sorted(order) != [1, 2, 3]:
        order = [1, 2, 3]
    stored = [int(header[name]) for name in ("nx", "ny", "nz")]
    stored[2] //= volumes_of(header)
    return [stored[order.index(axis)] for axis in (3, 2, 1)]


def volumes_of(header: Any) -> int:
    """Return the number of volumes in a stack of volumes along z; 1: it is not such a stack.

    MRC2014 gives such a stack the space group 401; `mz` is the number of sections of one volume.
    """
    sections, sampling = int(header["nz"]), int(header["mz"])
    is_stack = int(header["ispg"]) == STACK_OF_VOLUMES and int(header["maps"]) in (0, 3)
    if not is_stack or not 0 < sampling < sections or sections % sampling:
        return 1
    return sections // sampling


def settle_order(header: Any) -> tuple[list[int], tuple[str, ...]]:
    """Return the axes (x 1, y 2, z 3) of sections, rows and columns, and notes."""
    stated = [int(header[name]) for name in ("maps", "mapr", "mapc")]
    if any(stated):
        return stated, ()
    usual = Statement(("x", "y", "z"), "as in most files", Trust.ASSUMED)
    return [3, 2, 1], settle(_ORDER, [usual]).notes


def angle_notes(header: Any) -> tuple[str, ...]:
    """Return a note if the cell's axes are not at right angles. Three angles of 0 state nothing."""
    angles = [float(header["cellb"][name]) for name in ("alpha", "beta", "gamma")]
    if not any(angles) or all(abs(angle - _RIGHT_ANGLE) <= _MIN_SKEW for angle in angles):
        return ()
    shown = ", ".join(f"{angle:g}" for angle in angles)
    return (
        f"cell angles (cellb): found {shown} degrees, expected 90 each: the voxels are shown at "
        "right angles, which shears the shape",
    )


def settle_sign(header: Any) -> tuple[bool, tuple[str, ...]]:
    """Return whether bytes are signed, and notes."""
    least, largest = float(header["dmin"]), float(header["dmax"])
    statements = [Statement("signed", "as MRC2014 defines them", Trust.ASSUMED)]
    if int(header["nversion"]) >= _FIRST_OF_2014:
        statements.append(Statement("signed", "the version of MRC2014", Trust.DERIVED))
    if (flag := _imod_flag(header)) is not None:
        statements.append(Statement("signed" if flag else "unsigned", "IMOD's flag"))
    if least < 0:
        statements.append(Statement("signed", f"dmin {least:g}", Trust.REPEATED))
    elif _LARGEST_SIGNED < largest <= np.iinfo(np.uint8).max:
        statements.append(Statement("unsigned", f"dmax {largest:g}", Trust.REPEATED))
    settled = settle(_SIGN, statements)
    return settled.value == "signed", settled.notes


def _imod_flag(header: Any) -> bool | None:
    """Return IMOD's flag for signed bytes; None: IMOD did not write the file.

    IMOD's stamp and flags are two 32-bit numbers in MRC2014's `extra2`, at bytes 152 and 156.
    """
    raw = header.tobytes()
    order = header.dtype["nx"].str[0].replace("|", "=")
    stamp, flags = np.frombuffer(raw[152:160], np.dtype(np.int32).newbyteorder(order))
    return bool(int(flags) & _SIGNED_FLAG) if int(stamp) == _IMOD_STAMP else None
