"""Objects of a label map and what is known of each: a table with a row an object."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

MAX_CATEGORIES = 255  # most words of a column; a column with more is left out, and the log says so
MISSING = -1  # the code of an object without a category


@dataclass(frozen=True, slots=True)
class Column:
    """One property of all objects.

    id          an identifier, unique in its table: the name of a primvar and of files
    name        for people, as the table or the pipeline calls it
    about       what the numbers are, for people: `Mean of CD8 over its voxels`; may be empty
    unit        `um`, `um2`, `um3`, `counts`, or empty
    values      float32 (n,), NaN: missing; of categories their codes, MISSING: none
    categories  for people, by code; empty: the values are numbers
    colors      linear RGB 0..1 by code, as many as categories
    """

    id: str
    name: str
    values: NDArray[np.float32]
    about: str = ""
    unit: str = ""
    categories: tuple[str, ...] = ()
    colors: tuple[tuple[float, float, float], ...] = ()


@dataclass(frozen=True, slots=True)
class SharedWalls:
    """Walls that objects share.

    labels    uint64 (m, 2), of the two objects
    area_um2  float32 (m,), at the finest level; NaN: not known
    """

    labels: NDArray[np.uint64]
    area_um2: NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class ObjectTable:
    """All objects of a label map, n rows, in the order of the tiles that hold them.

    labels   uint64 (n,), the objects' numbers in the label map, each once
    names    for people, by row, as organs have them; empty: the numbers are all there is
    boxes    float32 (n, 6): least and largest (x, y, z), um, as `world` of the meshes
    rows     int32 by tile: the rows of the objects in a tile's meshes, in the order in which the
             meshes number them (Mesh.objects). An object that is larger than its tile's
             surroundings has a piece in several tiles, and one row
    columns  the properties; `volume_um3` is always the first
    default  ID of the column that colours objects first; empty: each has a hue of its own
    walls    int32 (m, 2): rows of two objects that share a wall, each pair once; None: not known
    wall_um2 float32 (m,), the area of that wall at the finest level; NaN: not known
    colors   float32 (n, 3), linear RGB: the label map's own; NaN: it has none. None: of no object
    """

    labels: NDArray[np.uint64]
    boxes: NDArray[np.float32]
    rows: dict[str, NDArray[np.int32]]
    columns: tuple[Column, ...]
    names: tuple[str, ...] = ()
    default: str = ""
    walls: NDArray[np.int32] | None = None
    wall_um2: NDArray[np.float32] | None = None
    colors: NDArray[np.float32] | None = None

    def of_tile(self, tile: str) -> "ObjectTable":
        """Return the table of one tile's objects, in the order in which its meshes number them."""
        rows = self.rows[tile]
        return replace(
            self,
            labels=self.labels[rows],
            boxes=self.boxes[rows],
            rows={tile: np.arange(len(rows), dtype=np.int32)},
            columns=tuple(replace(one, values=one.values[rows]) for one in self.columns),
            names=tuple(self.names[row] for row in rows.tolist()) if self.names else (),
            walls=None,
            wall_um2=None,
            colors=None if self.colors is None else self.colors[rows],
        )

    def touching(self, tile: str) -> SharedWalls:
        """Return the walls of a tile's objects, theirs the first label."""
        if self.walls is None or self.wall_um2 is None:
            return SharedWalls(np.zeros((0, 2), np.uint64), np.zeros(0, np.float32))
        both = np.concatenate([self.walls, self.walls[:, ::-1]])
        kept = np.isin(both[:, 0], self.rows[tile])
        return SharedWalls(self.labels[both[kept]], np.tile(self.wall_um2, 2)[kept])

    def column(self, column_id: str) -> Column | None:
        """Return a column by its ID; None: there is none."""
        return next((column for column in self.columns if column.id == column_id), None)
