# ruff: noqa: E501  (tables of cases)
"""NIfTI: fields of the header that lie, streams of gzip, voxels that are not numbers."""

import gzip
import os
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import nibabel
import numpy as np

from malformed.cases import Case, copied, plan, slices

KIND = "nifti"
# byte offsets and types of the fields of NIfTI-1
_FIELDS = {
    "sizeof_hdr": (0, "i"), "dim": (40, "8h"), "datatype": (70, "h"), "bitpix": (72, "h"),
    "pixdim": (76, "8f"), "vox_offset": (108, "f"), "scl_slope": (112, "f"), "scl_inter": (116, "f"),
    "xyzt_units": (123, "B"), "qform_code": (252, "h"), "sform_code": (254, "h"),
    "quatern_b": (256, "f"), "srow_x": (280, "4f"), "srow_z": (312, "4f"), "magic": (344, "4s"),
}  # fmt: skip
_NAN, _INF = float("nan"), float("inf")


def cases() -> Iterator[Case]:
    for name in ("f.nii", "f.nii.gz"):
        yield _damaged(f"{name} is empty", lambda p: p.write_bytes(b""), name, "refused")
    yield from _fields()
    yield from _voxels()
    yield from _streams()


def _damaged(
    name: str, spoil: Callable[[Path], Any], file: str = "f.nii", expect: str = "any"
) -> Case:
    def make(base: Path, folder: Path) -> list[str]:
        path = copied(base, folder, file)
        spoil(path)
        return plan(path.name)

    return Case(name, KIND, make, expect)


def _set(path: Path, **fields: Any) -> None:
    content = bytearray(path.read_bytes())
    for name, value in fields.items():
        place, kind = _FIELDS[name]
        values = value if isinstance(value, tuple) else (value,)
        struct.pack_into("<" + kind, content, place, *values)
    path.write_bytes(content)


def _fields() -> Iterator[Case]:
    dims = {
        "0": (0,) * 8, "9": (9, 2, 2, 2, 2, 2, 2, 2), "-1": (-1,) * 8, "2": (2, 48, 36, 1, 1, 1, 1, 1),
        "32767 each": (3, 32767, 32767, 32767, 1, 1, 1, 1), "32767 in all 7": (7, *[32767] * 7),
        "below 0": (3, -36, 48, 16, 1, 1, 1, 1), "zero": (3, 36, 0, 16, 1, 1, 1, 1),
        "one more": (3, 36, 48, 17, 1, 1, 1, 1), "one plane": (3, 36, 48, 1, 1, 1, 1, 1),
        "32767 times": (4, 36, 48, 16, 32767, 1, 1, 1), "five": (5, 36, 48, 4, 1, 4, 1, 1),
    }  # fmt: skip
    for name, value in dims.items():
        yield _damaged(
            f"dim {name}",
            lambda p, v=value: _set(p, dim=v),
            expect="refused" if name != "32767 times" else "any",
        )
    for value in (0, 1, 3, 32, 128, 1536, 1792, 2304, 9999, -4, 1280):
        yield _damaged(f"datatype {value}", lambda p, v=value: _set(p, datatype=v))
    yield _damaged("bitpix of another type", lambda p: _set(p, bitpix=64))
    for value in (0.0, 10.0, -352.0, 1e30, _NAN, _INF, 352.5, 1e9):
        yield _damaged(f"vox_offset {value}", lambda p, v=value: _set(p, vox_offset=v))
    for value in (0.0, _NAN, _INF, 1e38, 1e-45, -1.0):
        yield _damaged(f"scl_slope {value}", lambda p, v=value: _set(p, scl_slope=v))
        yield _damaged(f"scl_inter {value}", lambda p, v=value: _set(p, scl_slope=1.0, scl_inter=v))
    for value in (0.0, _NAN, _INF, -1.0, 1e38, 1e-38):
        pixdim = (1.0, value, 1.0, 1.0, 0, 0, 0, 0)
        yield _damaged(
            f"pixdim {value} by qform",
            lambda p, v=pixdim: _set(p, pixdim=v, sform_code=0, qform_code=1),
        )
        yield _damaged(
            f"pixdim {value} alone",
            lambda p, v=pixdim: _set(p, pixdim=v, sform_code=0, qform_code=0),
        )
        row = (value, 0.0, 0.0, value)
        yield _damaged(f"srow {value}", lambda p, v=row: _set(p, srow_x=v, sform_code=1))
    yield _damaged(
        "sform singular", lambda p: _set(p, srow_x=(0, 0, 1, 0), srow_z=(0, 0, 1, 0), sform_code=1)
    )
    yield _damaged(
        "sform all but singular",
        lambda p: _set(p, srow_x=(1, 1, 0, 0), srow_z=(1, 1.001, 1, 0), sform_code=1),
    )
    yield _damaged(
        "quaternion beyond 1", lambda p: _set(p, quatern_b=5.0, sform_code=0, qform_code=1)
    )
    yield _damaged("quaternion NaN", lambda p: _set(p, quatern_b=_NAN, sform_code=0, qform_code=1))
    yield _damaged("unknown unit", lambda p: _set(p, xyzt_units=255))
    yield _damaged("codes absurd", lambda p: _set(p, sform_code=-7, qform_code=999))
    for value in (b"abcd", b"ni1\0", b"n+9\0", b"\0" * 4):
        yield _damaged(f"magic {value!r}", lambda p, v=value: _set(p, magic=v))
    yield _damaged("header of another length", lambda p: _set(p, sizeof_hdr=540))
    yield _damaged("extension of 2^31 bytes", lambda p: _extend(p, 0x7FFFFFF0))
    yield _damaged("extension of -1 bytes", lambda p: _extend(p, -1))
    yield _damaged("extension of 0 bytes", lambda p: _extend(p, 0))

    def second(base: Path, folder: Path) -> list[str]:
        head = nibabel.Nifti2Header()
        head.set_data_shape((4, 4, 4))
        content = bytearray(head.binaryblock + bytes(4 + 200))
        struct.pack_into("<8q", content, 16, 3, 2**62, 2**62, 2**62, 1, 1, 1, 1)
        (folder / "x.nii").write_bytes(content)
        return plan("x.nii")

    yield Case("NIfTI-2 of 2^62 each way", KIND, second, "refused")


def _extend(path: Path, size: int) -> None:
    content = bytearray(path.read_bytes())
    content[348:352] = b"\x01\0\0\0"
    content[352:352] = struct.pack("<2i", size, 6) + bytes(8)
    path.write_bytes(content)


def _voxels() -> Iterator[Case]:
    ramp = np.arange(8 * 9 * 10, dtype=np.float32).reshape(8, 9, 10)
    one = ramp.copy()
    one[3, 4, 5] = _INF
    huge = ramp.astype(np.float64) * 1e300
    for name, voxels, expect in (
        ("all NaN", np.full_like(ramp, _NAN), "refused"),
        ("all infinite", np.full_like(ramp, _INF), "refused"),
        ("one infinite", one, "done"), ("NaN and infinite", np.where(ramp > 9, _NAN, _INF), "refused"),
        ("half NaN", np.where(ramp > 300, _NAN, ramp).astype(np.float32), "done"),
        ("beyond float32", huge, "refused"), ("complex", ramp.astype(np.complex64), "refused"),
        ("int64", ramp.astype(np.int64), "any"),
        ("largest int64", np.full(ramp.shape, 2**63 - 1, np.int64), "any"),
        ("denormals", np.full_like(ramp, 1e-45), "any"), ("largest floats", np.where(ramp > 300, 3e38, -3e38).astype(np.float32), "any"),
        ("constant", np.zeros_like(ramp), "done"),
    ):  # fmt: skip
        for command in (plan, slices):

            def make(
                base: Path, folder: Path, voxels: Any = voxels, command: Any = command
            ) -> list[str]:
                image = nibabel.Nifti1Image(voxels, np.eye(4), dtype=voxels.dtype)
                image.header.set_xyzt_units("mm")
                nibabel.save(image, folder / "x.nii")
                return command("x.nii")

            yield Case(f"{command.__name__} of voxels {name}", KIND, make, expect)


def _streams() -> Iterator[Case]:
    def packed(name: str, pack: Callable[[bytes], bytes], expect: str = "any") -> Case:
        def make(base: Path, folder: Path) -> list[str]:
            (folder / "x.nii.gz").write_bytes(pack((base / "f.nii").read_bytes()))
            return plan("x.nii.gz")

        return Case(name, KIND, make, expect)

    def head(dim: tuple[int, ...], content: bytes) -> bytes:
        changed = bytearray(content[:352])
        struct.pack_into("<8h", changed, *(40, *dim))
        return bytes(changed)

    zeros = gzip.compress(bytes(1 << 24))
    yield packed("not packed", lambda c: c, "refused")
    yield packed("packed twice", lambda c: gzip.compress(gzip.compress(c)), "refused")
    yield packed("followed by 4 GB", lambda c: gzip.compress(c) + zeros * 256, "done")
    yield packed(
        "claims 12 GB",
        lambda c: gzip.compress(head((3, 2000, 2000, 1500, 1, 1, 1, 1), c)),
        "refused",
    )
    yield packed(
        "claims 3 GB in 400 bytes",
        lambda c: gzip.compress(head((3, 1200, 1200, 1000, 1, 1, 1, 1), c)),
        "refused",
    )
    yield packed("offset 4 GB on", lambda c: gzip.compress(_with_offset(c)) + zeros * 256, "any")
    yield packed("damaged sum", lambda c: gzip.compress(c)[:-8] + bytes(8), "any")
    yield packed("zlib, not gzip", lambda c: zlib.compress(c), "refused")
    yield _damaged("is a pipe", lambda p: (p.unlink(), os.mkfifo(p)), expect="refused")
    yield _damaged("is a folder", lambda p: (p.unlink(), p.mkdir()), expect="refused")
    yield _damaged(
        "is without end", lambda p: (p.unlink(), os.symlink("/dev/zero", p)), expect="refused"
    )
    yield _damaged(
        "is a link to itself", lambda p: (p.unlink(), os.symlink(p.name, p)), expect="refused"
    )


def _with_offset(content: bytes) -> bytes:
    changed = bytearray(content)
    struct.pack_into("<f", changed, 108, float(1 << 32))
    return bytes(changed)
