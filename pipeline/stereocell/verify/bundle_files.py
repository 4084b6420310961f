"""Read the files of a bundle, to compare them with their sources."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import zstandard
from numpy.typing import NDArray

from stereocell.bundle.manifest import REMEDY
from stereocell.model.errors import CheckError
from stereocell.storage.json_files import read_json

COLOR_STEP = 1 / 255 + 1e-6  # 0..1, largest difference of a colour: one step of 8 bits


def read_transfer2d(bundle: Path, channel: dict[str, Any]) -> dict[str, Any]:
    """Return a channel's 2D transfer functions. Raises OutputError if they are invalid."""
    path = bundle / channel["transfer_functions_2d"]["file"]["path"]
    return dict(read_json(path, "transfer2d.schema.json", REMEDY))


def read_texels(file: Path) -> list[NDArray[np.uint8]]:
    """Return the mip levels of a bundle's KTX2 file, finest first, uint8 (z, y, x, components).

    Raises CheckError if the file can't be read or decoded.
    """
    try:
        data = file.read_bytes()
        width, height, depth, _, _, count = np.frombuffer(data, "<u4", 6, 20).tolist()
        components = {9: 1, 16: 2, 37: 4}[int(np.frombuffer(data, "<u4", 1, 12)[0])]
        levels = []
        for k in range(count):
            offset, length, size = np.frombuffer(data, "<u8", 3, 80 + 24 * k).tolist()
            frame = data[offset : offset + length]
            texels = zstandard.ZstdDecompressor().decompress(frame, max_output_size=size)
            shape = [max(1, n >> k) for n in (max(1, depth), height, width)]
            levels.append(np.frombuffer(texels, np.uint8).reshape(*shape, components))
    except OSError as error:
        raise CheckError(f"{file}: {error.strerror or error}") from error
    except (ValueError, LookupError, zstandard.ZstdError) as error:
        raise CheckError(f"{file}: can't be decoded: {error!r}") from error
    return levels


def find_differences(
    name: str, found: dict[str, Any], expected: dict[str, Any], source: str = "the stage"
) -> Iterator[str]:
    """Yield a line for each key of `expected` with another value in `found`."""
    for key, value in expected.items():
        if found[key] != value:
            yield f"{name}: {key} is {found[key]!r}, expected {value!r} as in {source}"
