"""Write bodies as Wavefront OBJ, and their colours as the .mtl beside it."""

from collections.abc import Sequence
from pathlib import Path

from stereocell.formats.body import Body
from stereocell.model.identifiers import to_identifier
from stereocell.model.version import GENERATOR

_ROWS = 10_000  # rows of numbers that are turned into text at a time


def write_obj(path: Path, bodies: Sequence[Body], *, unit: str) -> None:
    """Write path and path.with_suffix(".mtl"); names become identifiers, without spaces."""
    names = [to_identifier(body.name) for body in bodies]
    looks = path.with_suffix(".mtl")
    with looks.open("w", encoding="utf-8", newline="\n") as file:
        file.write(f"# {GENERATOR}\n")
        for name, body in zip(names, bodies, strict=True):
            red, green, blue = (part / 255 for part in body.srgb)
            file.write(f"newmtl {name}\nKd {red:.6f} {green:.6f} {blue:.6f}\nillum 1\n")
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(f"# {GENERATOR}, unit {unit}\nmtllib {looks.name}\n")
        first = 1
        for name, body in zip(names, bodies, strict=True):
            file.write(f"o {name}\nusemtl {name}\n")
            for form, rows in (
                ("v %.9g %.9g %.9g\n", body.positions),
                ("f %d %d %d\n", body.triangles.astype("i8") + first),
            ):
                for start in range(0, len(rows), _ROWS):
                    part = rows[start : start + _ROWS]
                    file.write((form * len(part)) % tuple(part.ravel().tolist()))
            first += len(body.positions)
