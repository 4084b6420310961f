"""Write what layers add to the specimen as one file of the bundle: additions.glb.

A mesh is a node below the root, whose extras have its ID. The viewer shows and hides each.
"""

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pxr import Usd

from stereocell.bundle.tile_part import FileRef
from stereocell.formats.plain_gltf import Document, PlainBuffers
from stereocell.storage.file_list import measure
from stereocell.usd.layer import METERS_PER_UNIT
from stereocell.usd.read_additions import read_additions

ADDITIONS = "additions.glb"


@dataclass(frozen=True, slots=True)
class WrittenAdditions:
    """The file, and the additions that are in it, in the stage's order: their IDs and names."""

    file: FileRef
    layers: tuple[dict[str, str], ...]

    def describe(self) -> dict[str, Any]:
        """Return what the manifest says of the additions."""
        file = {"path": self.file.path, "bytes": self.file.bytes, "sha256": self.file.sha256}
        return {"file": file, "layers": list(self.layers)}


def write_additions(stage: Usd.Stage, root: Path) -> WrittenAdditions | None:
    """Write the additions of a stage; None: it has none. Raises StageError and OutputError."""
    layers: list[dict[str, str]] = []
    with tempfile.TemporaryFile(dir=root) as file:
        document = Document("additions", PlainBuffers(file), {})
        for addition in read_additions(stage):
            layers.append({"id": addition.path, "name": addition.name})
            document.add(
                addition.name,
                addition.path,
                addition.mesh,
                addition.mesh.positions.astype(float) * METERS_PER_UNIT,
                addition.material,
                {"addition": addition.path},
            )
        if not layers:
            return None
        document.write(root / ADDITIONS)
    return WrittenAdditions(FileRef(ADDITIONS, **measure(root / ADDITIONS)), tuple(layers))
