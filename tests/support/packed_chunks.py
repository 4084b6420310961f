"""Write a JSON file of bytes that numcodecs packs, for tests of the page, which unpacks them."""

import base64
import itertools
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numcodecs import LZ4, Blosc, Zstd
from numpy.typing import NDArray


def arrays() -> dict[str, NDArray[Any]]:
    """Return values that pack well, badly, and not at all, and fewer values than a block has."""
    rng = np.random.default_rng(1)
    steps = np.cumsum(rng.integers(0, 3, 70_001)).astype(np.uint16)
    return {
        "steps": steps,
        "noise": rng.integers(0, 256, 20_000).astype(np.uint8),
        "zeros": np.zeros(100_000, np.float32),
        "repeats": np.tile(rng.integers(0, 60_000, 9_000).astype(np.int32), 9),
        "few": np.arange(13, dtype=np.int16),
        "doubles": np.sin(np.arange(30_000) / 50.0),
    }


def main() -> None:
    packers: dict[str, Any] = {"lz4": LZ4(), "zstd": Zstd()}
    for name, shuffle, level in itertools.product(
        ("blosclz", "lz4", "lz4hc", "zlib", "zstd"), (0, 1, 2), (1, 9)
    ):
        packers[f"blosc {name} {shuffle} {level}"] = Blosc(name, clevel=level, shuffle=shuffle)
    packers["blosc blocks"] = Blosc("lz4", shuffle=1, blocksize=4096)
    found = [
        {
            "name": f"{name}: {title}",
            "codec": name.split(" ", 1)[0],
            "packed": base64.b64encode(packer.encode(values)).decode(),
            "plain": base64.b64encode(values.tobytes()).decode(),
        }
        for name, packer in packers.items()
        for title, values in arrays().items()
    ]
    Path(sys.argv[1]).write_text(json.dumps(found))


if __name__ == "__main__":
    main()
