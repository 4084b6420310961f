"""Compare a picture of the viewer with that of the float64 reference renderer.

    bundle_picture.py BUNDLE PICTURE.png

Standard input names the channels and the camera (JSON: channels, eye_um, target_um, fov_deg); all
tiles are volumes. Prints the PSNR over the pixels where the reference draws, as JSON.
"""

import json
import struct
import sys
from pathlib import Path

import numpy as np
import zstandard
from numpy.typing import NDArray
from PIL import Image

from support.reference_raymarch import Block, Camera, encode, psnr, render

BACKGROUND = (11 / 255, 13 / 255, 18 / 255)  # sRGB, the background of the viewer's scene
LEVELS_AT = 80  # bytes; a KTX 2.0 file lists its levels there: offset, length, raw length


def unzstd(data: bytes, size: int) -> NDArray[np.uint8]:
    """Return the bytes of one zstd frame."""
    return np.frombuffer(zstandard.ZstdDecompressor().decompress(data, size), np.uint8)


def read_table(file: Path, row: int) -> NDArray[np.float64]:
    """Return one row (256, 4), 0..1, of a KTX2 texture of transfer functions."""
    data = file.read_bytes()
    offset, length, size = struct.unpack_from("<3Q", data, LEVELS_AT)
    rows = unzstd(data[offset : offset + length], size).reshape(-1, 256, 4)
    return rows[row] / 255


def read_blocks(bundle: Path, names: list[str]) -> list[Block]:
    """Return all tiles of these channels at their finest resolution level."""
    manifest = json.loads((bundle / "manifest.json").read_text("utf-8"))
    channels = [next(c for c in manifest["channels"] if c["id"] == name) for name in names]
    tables, tiles = [], []
    for channel in channels:
        row = channel["transfer_functions"].index(channel["transfer_function"])
        tables.append(read_table(bundle / channel["lut"]["path"], row))
        tiles.append(
            json.loads((bundle / channel["volumes"]["path"]).read_text("utf-8"))["volumes"]
        )
    blocks = []
    for parts in zip(*tiles, strict=True):
        voxels = []
        for part in parts:
            level = part["levels"][0]
            data = (bundle / part["file"]["path"]).read_bytes()
            frame = data[level["offset"] : level["offset"] + level["length"]]
            x, y, z = level["size"]
            voxels.append(unzstd(frame, x * y * z).reshape(z, y, x))
        box = parts[0]["bounds_um"]
        colors = np.array([channel["color"] for channel in channels])
        low, high = tuple(box["min"]), tuple(box["max"])
        blocks.append(Block(tuple(voxels), low, high, np.array(tables), colors, parts[0]["apron"]))
    return blocks


def main(bundle: Path, picture: Path) -> None:
    """Print as JSON the PSNR of the picture of the viewer."""
    asked = json.load(sys.stdin)
    found = np.asarray(Image.open(picture).convert("RGB"))
    height, width = found.shape[:2]
    camera = Camera(
        tuple(asked["eye_um"]), tuple(asked["target_um"]), (width, height), asked["fov_deg"]
    )
    whole = np.zeros((height, width, 4))
    eye = np.asarray(camera.eye_um)
    blocks = read_blocks(bundle, asked["channels"])
    for block in sorted(
        blocks, key=lambda b: float(np.abs(np.add(b.low_um, b.high_um) / 2 - eye).sum())
    ):
        behind = render(block, camera)
        whole += (1 - whole[..., 3:]) * behind
    drawn = whole[..., 3] > 1 / 255
    value = psnr(found, encode(whole, BACKGROUND), drawn)
    print(json.dumps({"psnr": value, "drawn": int(drawn.sum())}))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
