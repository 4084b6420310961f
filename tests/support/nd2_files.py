"""ND2 files, written byte by byte: the library nd2 only reads them.

A file is a chain of named chunks, and a map of their places at the end. Metadata are "CLX Lite": a
tree of typed values with names in UTF-16.
"""

import struct
import zlib
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

_MARK = b"\xda\xce\xbe\n"
_NAME_BYTES = 4072  # padded length of a frame's name
_TIME, _POSITION, _DEPTH = 1, 2, 4  # kinds of loops


def write_nd2(
    path: Path,
    tpzcyx: NDArray[np.uint16],
    spacing_um: tuple[float, float, float],
    *,
    is_packed: bool = False,
    without: Collection[int] = (),
    lights: Mapping[int, float] | None = None,
    about: Mapping[str, Any] | None = None,
    depth_loop: Mapping[str, Any] | None = None,
) -> dict[int, int]:
    """Write an ND2 file; return the byte offset of each frame's chunk by the frame's number.

    tpzcyx   voxels (t, p, z, c, y, x), p: stage position; a frame holds all channels of a plane
    without  numbers of frames that are left out, as in an acquisition that ended early
    about       additional fields of the image's metadata
    depth_loop  additional fields of the loop along z
    lights   emission in nm by channel; such a channel has no colour of its own
    """
    times, positions, depth, channels, height, width = tpzcyx.shape
    step, _, side = spacing_um
    along_z = {"uiCount": depth, "dZStep": step, **(depth_loop or {})}
    loops: dict[str, Any] = _loop(_DEPTH, along_z, None)
    points = {f"p{i}": {"dPosX": 10.0 * i, "dPosY": 0.0} for i in range(positions)}
    loops = _loop(_POSITION, {"uiCount": positions, "Points": points}, loops)
    period = {"uiCount": times, "dStart": 0.0, "dPeriod": 1.0, "dDuration": 1.0}
    loops = _loop(_TIME, period, loops)
    probe = {"m_ExcitationSpectrum": {"uiCount": 0}, "m_EmissionSpectrum": {"uiCount": 0}}
    plane = {"uiCompCount": 1, "pFluorescentProbe": probe}
    planes = {
        f"a{i}": plane | {"sDescription": name, "uiColor": color}
        for i, (name, color) in enumerate((("DAPI", 0xFF0000), ("GFP", 0x00FF00))[:channels])
    }
    for i, nm in (lights or {}).items():
        emission = {"uiCount": 1, "pPoint": {"Point0": {"dTValue": 1.0, "dWavelength": nm}}}
        lit = {"pFluorescentProbe": probe | {"m_EmissionSpectrum": emission}}
        planes[f"a{i}"] = plane | lit | {"sDescription": f"marker {i}", "uiColor": 0}
    picture = {"uiCount": channels, "sPlaneNew": planes}
    chunks = {
        b"ImageAttributesLV!": {
            "SLxImageAttributes": {
                "uiWidth": width, "uiHeight": height, "uiWidthBytes": 2 * width * channels,
                "uiComp": channels, "uiBpcInMemory": 16, "uiBpcSignificant": 16,
                "uiSequenceCount": times * positions * depth, "eCompression": 0 if is_packed else 2,
            }
        },
        b"ImageMetadataSeqLV|0!": {
            "SLxPictureMetadata": {
                "bCalibrated": True, "dCalibration": side, "sPicturePlanes": picture,
                **(about or {}),
            }
        },
        b"ImageMetadataLV!": loops,
    }  # fmt: skip
    content, places = _chunk(b"ND2 FILE SIGNATURE CHUNK NAME01!", b"Ver3.0".ljust(64, b"\0")), {}
    for name, tree in chunks.items():
        places[name] = len(content)
        content += _chunk(name, _tree(tree))
    frames = tpzcyx.transpose(0, 1, 2, 4, 5, 3).reshape(-1, height, width, channels)
    for number, frame in enumerate(frames):
        if number not in without:
            name = b"ImageDataSeq|%d!" % number
            places[name] = len(content)
            voxels = zlib.compress(frame.tobytes()) if is_packed else frame.tobytes()
            data = struct.pack("<d", number) + voxels
            content += _chunk(name.ljust(_NAME_BYTES, b"\0"), data)
    listed = b"".join(name + struct.pack("<2Q", at, 0) for name, at in places.items())
    mark = b"ND2 CHUNK MAP SIGNATURE 0000001!"
    end = mark + struct.pack("<Q", len(content))
    path.write_bytes(content + _chunk(b"ND2 FILEMAP SIGNATURE NAME 0001!", listed + mark) + end)
    return {int(n[13:-1]): at for n, at in places.items() if n.startswith(b"ImageDataSeq|")}


def _loop(kind: int, parameters: Mapping[str, Any], inner: Any) -> dict[str, Any]:
    loop: dict[str, Any] = {"eType": kind, "uLoopPars": parameters}
    return {
        "SLxExperiment": loop | ({"ppNextLevelEx": {"": inner["SLxExperiment"]}} if inner else {})
    }


def _chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack("<4sIQ", _MARK, len(name), len(data)) + name + data


def _tree(values: Mapping[str, Any]) -> bytes:
    return b"".join(_value(name, value) for name, value in values.items())


def _value(name: str, value: Any) -> bytes:
    named = f"{name}\0".encode("utf-16-le")
    if isinstance(value, Mapping):
        inner = _tree(value)
        length = 2 + len(named) + 12 + len(inner)
        head = struct.pack("<BB", 11, len(name) + 1) + named
        return head + struct.pack("<IQ", len(value), length) + inner + bytes(8 * len(value))
    kinds: dict[type, tuple[int, str]] = {bool: (1, "<B"), int: (3, "<I"), float: (6, "<d")}
    if isinstance(value, str):
        kind, data = 8, f"{value}\0".encode("utf-16-le")
    else:
        kind, form = kinds[type(value)]
        data = struct.pack(form, value)
    return struct.pack("<BB", kind, len(name) + 1) + named + data
