"""Write LSM, STK and NDTiff by their published layouts, because no available library writes them.

References: Zeiss, LSM 5 file format; MetaMorph, STK file format (UIC tags 33628 to 33630);
Micro-Manager, NDTiff specification.
"""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import tifffile
from numpy.typing import NDArray

_LSM_INFO = 34412  # TIFF tag
_LSM_BYTES = 500


def write_lsm(
    path: Path,
    voxels: NDArray[Any],
    spacing_um: tuple[float, float, float],
    channels: dict[str, tuple[int, int, int]],
) -> Path:
    """Write a stack (z, c, y, x): a page for each z, each followed by a thumbnail.

    channels  name -> colour (sRGB bytes)
    """
    depth, count, height, width = voxels.shape
    info = bytearray(_LSM_BYTES)
    struct.pack_into("<Ii7i", info, 0, 67127628, _LSM_BYTES, width, height, depth, count, 1, 0, 8)
    z, y, x = spacing_um
    struct.pack_into("<3d", info, 40, x * 1e-6, y * 1e-6, z * 1e-6)
    tag = (_LSM_INFO, 1, len(info), bytes(info), True)
    thumb = np.zeros((3, 8, 8), np.uint8)
    with tifffile.TiffWriter(path, byteorder="<") as writer:
        options: dict[str, Any] = {"metadata": None, "contiguous": False}
        for index, page in enumerate(voxels):
            first = {"extratags": [tag], "software": False} if index == 0 else {}
            kind: dict[str, Any] = {"photometric": "minisblack"}
            if count > 1:
                kind |= {"photometric": "rgb" if count == 3 else None, "planarconfig": "separate"}
            writer.write(page if count > 1 else page[0], **options, **first, **kind)
            writer.write(
                thumb, photometric="rgb", planarconfig="separate", subfiletype=1, **options
            )
    content = bytearray(path.read_bytes())
    at = content.index(bytes(info[:40]))
    # ChannelColors: sizes, offsets from its start, colours, then each name preceded by its length
    colors = b"".join(struct.pack("<4B", *rgb, 0) for rgb in channels.values())
    names = b"".join(struct.pack("<I", len(name) + 1) + name.encode() + b"\0" for name in channels)
    head = struct.pack("<6I", 24 + len(colors) + len(names), count, count, 24, 24 + len(colors), 0)
    struct.pack_into("<I", content, at + 108, len(content))
    path.write_bytes(bytes(content) + head + colors + names)
    return path


def write_stk(
    path: Path, voxels: NDArray[np.uint16], spacing_um: tuple[float, float, float]
) -> Path:
    """Write a stack (z, y, x): one directory, then the planes one after another."""
    depth, height, width = voxels.shape
    z, y, x = spacing_um
    content = bytearray(b"II*\0\0\0\0\0") + voxels.astype("<u2").tobytes()

    def put(data: bytes) -> int:
        content.extend(bytes(len(content) % 2))
        content.extend(data)
        return len(content) - len(data)

    def fraction(value: float) -> bytes:
        return struct.pack("<2I", round(value * 1_000_000), 1_000_000)

    unit = put(struct.pack("<I", 3) + b"um\0")
    sides = put(fraction(x)), put(fraction(y))
    general = put(struct.pack("<8I", 3, 1, 4, sides[0], 5, sides[1], 6, unit))
    planes = b"".join(
        fraction(z) + struct.pack("<4I", 2459000, i, 2459000, i) for i in range(depth)
    )
    by_plane = put(planes)
    waves = put(b"".join(fraction(500) for _ in range(depth)))
    tags = {
        256: (4, 1, width), 257: (4, 1, height), 258: (3, 1, 16), 259: (3, 1, 1), 262: (3, 1, 1),
        273: (4, 1, 8), 277: (3, 1, 1), 278: (4, 1, height), 279: (4, 1, 2 * height * width),
        33628: (4, 4, general), 33629: (5, depth, by_plane), 33630: (5, depth, waves),
    }  # fmt: skip
    entries = b"".join(struct.pack("<2H2I", tag, *entry) for tag, entry in tags.items())
    at = put(struct.pack("<H", len(tags)) + entries + bytes(4))
    struct.pack_into("<I", content, 4, at)
    path.write_bytes(content)
    return path


def write_ndtiff(path: Path, voxels: NDArray[np.uint16], channels: list[str]) -> Path:
    """Write a stack (c, z, y, x), and the index beside it; only the index names the axes."""
    _, depth, height, width = voxels.shape
    summary = json.dumps({"PixelSize_um": 0.5, "z-step_um": 2.0}).encode()
    content = bytearray(b"II*\0\0\0\0\0")
    content += struct.pack("<5I", 483729, 3, 2, 2355492, len(summary)) + summary
    link, index = 4, b""
    for number, plane in enumerate(voxels.reshape(-1, height, width)):
        content += bytes(len(content) % 2)
        pixels = len(content)
        content += plane.astype("<u2").tobytes()
        about = b'{"Camera": "none"}\0\0'
        content += about
        tags = {
            256: (4, 1, width), 257: (4, 1, height), 258: (3, 1, 16), 259: (3, 1, 1),
            262: (3, 1, 1), 273: (4, 1, pixels), 277: (3, 1, 1), 278: (3, 1, height),
            279: (4, 1, 2 * height * width), 51123: (2, len(about), len(content) - len(about)),
        }  # fmt: skip
        struct.pack_into("<I", content, link, len(content))
        entries = b"".join(struct.pack("<2H2I", tag, *entry) for tag, entry in tags.items())
        content += struct.pack("<H", len(tags)) + entries
        link = len(content)
        content += bytes(4)
        place = {"channel": channels[number // depth], "z": number % depth}
        for text in (json.dumps(place).encode(), path.name.encode()):
            index += struct.pack("<I", len(text)) + text
        index += struct.pack("<8I", pixels, width, height, 1, 0, pixels, 0, 0)
    path.write_bytes(content)
    (path.parent / "NDTiff.index").write_bytes(index)
    return path
