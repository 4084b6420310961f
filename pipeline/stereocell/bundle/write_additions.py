"""Write additions.glb: the meshes and curves that layers add to the specimen.

Each addition is a node below the root, with its ID in the node's extras. The viewer shows and hides
each of them.
"""

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Usd

from stereocell.bundle.tile_part import FileRef
from stereocell.formats.plain_gltf import Document, PlainBuffers
from stereocell.storage.file_list import measure
from stereocell.usd.layer import METERS_PER_UNIT
from stereocell.usd.read_additions import read_additions

ADDITIONS = "additions.glb"


@dataclass(frozen=True, slots=True)
class WrittenAdditions:
    """The file additions.glb and its content.

    layers     ID and name of each addition, in the stage's order
    low, high  corners (x, y, z) of the box around all additions, world um
    """

    file: FileRef
    layers: tuple[dict[str, str], ...]
    low: list[float]
    high: list[float]

    def describe(self) -> dict[str, Any]:
        """Return the manifest's entry for the additions."""
        file = {"path": self.file.path, "bytes": self.file.bytes, "sha256": self.file.sha256}
        bounds = {"min": self.low, "max": self.high}
        return {"file": file, "layers": list(self.layers), "bounds_um": bounds}


def write_additions(stage: Usd.Stage, root: Path) -> WrittenAdditions | None:
    """Write the additions of a stage; None: it has none. Raises StageError and OutputError."""
    layers: list[dict[str, str]] = []
    corners: list[NDArray[np.float64]] = []
    with tempfile.TemporaryFile(dir=root) as file:
        document = Document("additions", PlainBuffers(file), {})
        for addition in read_additions(stage):
            layers.append({"id": addition.path, "name": addition.name})
            positions = addition.mesh.positions.astype(float)
            corners += [positions.min(axis=0), positions.max(axis=0)]
            document.add(
                addition.name,
                addition.path,
                addition.mesh,
                positions * METERS_PER_UNIT,
                addition.material,
                {"addition": addition.path},
            )
        if not layers:
            return None
        document.write(root / ADDITIONS)
    low, high = (
        [round(float(v), 4) for v in end]
        for end in (np.min(corners, axis=0), np.max(corners, axis=0))
    )
    file_ref = FileRef(ADDITIONS, **measure(root / ADDITIONS))
    return WrittenAdditions(file_ref, tuple(layers), low, high)
