"""The head of an NRRD file, for voxels that follow it or are in a separate file.

pynrrd is not used, because it writes the date into its files and needs all voxels in memory.

References: NRRD format definition, https://teem.sourceforge.net/nrrd/format.html
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from stereocell.formats.voxel_grid import VoxelGrid
from stereocell.model.version import GENERATOR

_TYPES = {"uint8": "uint8", "uint16": "uint16", "int16": "int16"}


def nrrd_head(
    grid: VoxelGrid, dtype: np.dtype[np.integer[Any]], names: Sequence[str], *, data_file: str = ""
) -> bytes:
    """Return the head. Raw voxels follow, with x fastest, then y, z and channels.

    names      names of the channels, in order
    data_file  name of the file that holds the voxels; empty: they follow the head
    """
    many = len(names) > 1
    sizes = " ".join(map(str, [*grid.size, *([len(names)] if many else [])]))
    steps = " ".join(_vector(grid.direction[:, axis] * grid.spacing[axis]) for axis in range(3))
    lines = [
        "NRRD0005",
        f"# {GENERATOR}",
        f"type: {_TYPES[dtype.name]}",
        f"dimension: {4 if many else 3}",
        "space: left-posterior-superior" if grid.is_patient else "space dimension: 3",
        f"sizes: {sizes}",
        f"space directions: {steps}" + (" none" if many else ""),
        "kinds: domain domain domain" + (" list" if many else ""),
        "endian: little",
        "encoding: raw",
        f"space origin: {_vector(grid.origin)}",
        "space units: " + " ".join([f'"{grid.unit}"'] * 3),
        *([f"data file: {data_file}"] if data_file else []),
        *(f"channel_{number}:={_line(name)}" for number, name in enumerate(names)),
    ]
    return ("\n".join(lines) + ("\n" if data_file else "\n\n")).encode()


def _vector(numbers: np.ndarray) -> str:
    return f"({','.join(repr(float(n)) for n in numbers)})"


def _line(text: str) -> str:
    return text.replace("\\", "\\\\").replace("\n", "\\n")
