"""OpenEXR images: volumes as slice atlases, and transfer functions as lookup tables.

An atlas lays the slices of a volume out in columns x rows, with slice 0 at the upper left, as game
engines import 3D textures. Its only channel is `Y`, which readers show as grey; a single `R` would
be red. Half floats hold steps of 1/255 so exactly that the same bytes are read back.

Compression, 196 x 514 x 514 noisy voxels on 2 cores: PIZ 0.5 s and 31 MB; ZIP 1.3 s and 52 MB; RLE
0.4 s and 97 MB.
"""

import struct
from functools import cache
from pathlib import Path

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from stereocell.kernels.atlas import cut_slices
from stereocell.model.channel import OpacityPoints
from stereocell.model.errors import OutputError, StageError
from stereocell.model.tile_content import APRON
from stereocell.storage.atomic_write import replacing
from stereocell.transfer.opacity import evaluate

_MAGIC = b"\x76\x2f\x31\x01"
_OTHER_LAYOUTS = 0x200 | 0x800 | 0x1000  # bits of the version: tiles, deep data, several parts
# Number of pixel rows in a chunk, by OpenEXR's code of the compression
_ROWS_OF = {0: 1, 1: 1, 2: 1, 3: 16, 4: 32, 5: 16, 6: 32, 7: 32, 8: 32, 9: 256}
_LEVELS = (np.arange(256, dtype=np.float32) / 255).astype(np.float16)


def write_atlas(path: Path, volume: NDArray[np.uint8]) -> None:
    """Write a volume as `volume` / 255 in half floats.

    volume  uint8 (z, y, x), with its apron

    The header holds the numbers for cutting it into slices: `columns`, `rows`, `atlasSize`
    (x, y, z), `apron`. Raises OutputError if the file cannot be written.

    >>> import tempfile
    >>> volume = np.arange(4 * 6 * 8, dtype=np.uint8).reshape(4, 6, 8)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_atlas(Path(folder) / "cell.exr", volume)
    ...     np.array_equal(read_atlas(Path(folder) / "cell.exr"), volume)
    True
    """
    depth, height, width = volume.shape
    # With this number of columns, the atlas is nearly square.
    columns = min(depth, max(1, round((depth * height / width) ** 0.5)))
    rows = -(-depth // columns)
    image = np.zeros((rows, height, columns, width), np.float16)
    for place, slice_ in enumerate(volume):  # the indices of one slice fit into the cache
        image[place // columns, :, place % columns] = _LEVELS[slice_]
    attributes = {
        "columns": columns,
        "rows": rows,
        "atlasSize": np.array([width, height, depth], dtype=np.int32),
        "apron": APRON,
    }
    _write(path, {"Y": image.reshape(rows * height, columns * width)}, attributes)


def read_atlas(path: Path) -> NDArray[np.uint8]:
    """Return the volume of an atlas, uint8 (z, y, x) with its apron.

    Raises StageError if the file is missing, damaged, or not an atlas.
    """
    check_exr(path)
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            header, channels = dict(file.header()), file.channels()
            image = channels["Y"].pixels if "Y" in channels else None
    # ValueError: the header is complete, but pixels are damaged
    except (RuntimeError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise StageError(f"{path}: can't be read as OpenEXR: {reason}") from error
    lacking = [key for key in ("columns", "rows", "atlasSize") if key not in header]
    if image is None or lacking:
        what = f"header attribute {lacking[0]}" if lacking else "channel Y"
        raise StageError(f"{path}: no {what}, expected a slice atlas")
    width, height, depth = (int(n) for n in header["atlasSize"])
    columns, rows = int(header["columns"]), int(header["rows"])
    if image.shape != (rows * height, columns * width) or not 0 < depth <= rows * columns:
        raise StageError(
            f"{path}: {image.shape[1]} x {image.shape[0]} pixels do not hold {depth} slices of "
            f"{width} x {height} in {columns} x {rows} places"
        )
    if image.dtype == np.float16:
        slices = np.empty((depth, height, width), np.uint8)
        cut_slices(image.view(np.uint16), _bytes_of_halves(), slices)
        return slices
    sheet = _to_bytes(image)  # another program wrote values of another type than half floats
    in_places = sheet.reshape(rows, height, columns, width).transpose(0, 2, 1, 3)
    return np.ascontiguousarray(in_places.reshape(-1, height, width)[:depth])


def read_rgb(path: Path) -> NDArray[np.float32]:
    """Return the colours of an image, linear (height, width, 3); infinities and NaN become 0.

    Raises StageError if the file is missing, damaged, or has no colours.
    """
    check_exr(path)
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            channels = {name: np.array(one.pixels) for name, one in file.channels().items()}
    except (RuntimeError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise StageError(f"{path}: can't be read as OpenEXR: {reason}") from error
    names = "RGB" if "R" in channels else "YYY"
    lacking = [name for name in names if name not in channels]
    if lacking:
        raise StageError(f"{path}: no channel {lacking[0]}, expected an image in colour or grey")
    image = np.stack([channels[name] for name in names], axis=-1).astype(np.float32)
    return np.maximum(np.nan_to_num(image, posinf=0.0, neginf=0.0), 0.0)


@cache
def _bytes_of_halves() -> NDArray[np.uint8]:
    """Return the byte of each half float, by its bits. Arithmetic takes four times as long."""
    return _to_bytes(np.arange(1 << 16, dtype=np.uint16).view(np.float16))


def _to_bytes(shares: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Return 0..1 as 0..255. Values beyond become the nearest end, and NaN becomes 0."""
    with np.errstate(invalid="ignore"):  # a half float may be NaN
        known = np.nan_to_num(shares.astype(np.float32))
    return np.asarray(np.rint(known.clip(0, 1) * 255).astype(np.uint8))


def check_exr(path: Path) -> None:
    """Raise StageError if a file is missing, is not OpenEXR, or was cut short.

    The function follows the chunk offsets (OpenEXR's "File Layout") and reads no pixels. For a file
    that was cut short, the OpenEXR library would print lines of its own before it raises an error.
    Tiled, deep and multi-part files, which the pipeline never writes, are checked only by their
    first bytes.
    """
    try:
        content = np.memmap(path, dtype=np.uint8, mode="r").data
        damage = _find_damage(content)
    except OSError as error:
        raise StageError(f"{path}: can't be read: {error.strerror or error}") from error
    except ValueError:  # an empty file cannot be mapped
        damage = "the file is empty"
    except (struct.error, IndexError, KeyError):
        damage = "its header was cut short"
    if damage is not None:
        raise StageError(f"{path}: can't be read as OpenEXR: {damage}")


def _find_damage(content: memoryview) -> str | None:
    if bytes(content[:4]) != _MAGIC:
        return "its first bytes are not OpenEXR's"
    (version,) = struct.unpack_from("<I", content, 4)
    if version & _OTHER_LAYOUTS:
        return None
    attributes = {}
    at = 8
    while content[at]:
        name, at = _text_at(content, at)
        _, at = _text_at(content, at)
        (size,) = struct.unpack_from("<I", content, at)
        attributes[name] = content[at + 4 : at + 4 + size]
        at += 4 + size
    _, top, _, bottom = struct.unpack("<4i", attributes[b"dataWindow"])
    rows = _ROWS_OF.get(attributes[b"compression"][0])
    if rows is None:
        return None
    count = (bottom - top) // rows + 1
    for offset in struct.unpack_from(f"<{count}Q", content, at + 1):
        if not at < offset <= len(content) - 8:
            return f"the file ends at byte {len(content)}, before its last rows"
        _, size = struct.unpack_from("<2i", content, offset)
        if size < 0 or offset + 8 + size > len(content):
            return f"the file ends at byte {len(content)}, expected {offset + 8 + size} or more"
    return None


def _text_at(content: memoryview, start: int) -> tuple[bytes, int]:
    """Return the text that ends in a zero byte, and the position after that byte."""
    end = start
    while content[end]:
        end += 1
    return bytes(content[start:end]), end + 1


def write_lut(path: Path, points: OpacityPoints) -> None:
    """Write a transfer function as 256 x 1 RGBA half floats, opacity in A.

    points  (intensity, opacity) pairs, rising, 0..1

    RGB is 1, and a client multiplies it by the channel's colour. Column i is intensity i / 255.
    Raises OutputError if the file cannot be written.
    """
    table = np.ones((1, 256, 4), dtype=np.float16)
    table[0, :, 3] = evaluate(points)
    _write(path, {"RGBA": table}, {})


def write_rgb(path: Path, image: NDArray[np.float32]) -> None:
    """Write colours, linear (height, width, 3), as half floats of at most 65504.

    Raises OutputError if the file cannot be written.
    """
    largest = np.finfo(np.float16).max
    _write(path, {"RGB": image.clip(0, largest).astype(np.float16)}, {})


def _write(
    path: Path, channels: dict[str, NDArray[np.float16]], attributes: dict[str, object]
) -> None:
    header = {"compression": OpenEXR.PIZ_COMPRESSION, "type": OpenEXR.scanlineimage, **attributes}
    with replacing(path) as temporary:
        try:
            OpenEXR.File(header, channels).write(str(temporary))
        except RuntimeError as error:
            raise OutputError(
                f"{path}: can't be written: {' '.join(str(error).split())}"
            ) from error
