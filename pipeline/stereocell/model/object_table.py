"""The table of a label map's objects, with a row for each object."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

MAX_CATEGORIES = 255  # most categories of a column; a column with more is left out with a note
MISSING = -1  # code of an object without a category


@dataclass(frozen=True, slots=True)
class Column:
    """One property of all objects.

    id          identifier, unique in its table; it names a primvar and files
    name        name for people, from the table or the pipeline
    values      float32 (n,): numbers, NaN if missing; or codes of categories, MISSING if there is
                none
    about       explanation for people, such as `Mean of CD8 over its voxels`; may be empty
    unit        `um`, `um2`, `um3`, `counts`, or empty
    categories  names of the categories by code; empty: the values are numbers
    colors      linear RGB, 0..1, of each category
    """

    id: str
    name: str
    values: NDArray[np.float32]
    about: str = ""
    unit: str = ""
    categories: tuple[str, ...] = ()
    colors: tuple[tuple[float, float, float], ...] = ()


@dataclass(frozen=True, slots=True)
class SharedInterfaces:
    """Interfaces between objects.

    labels    uint64 (m, 2), labels of the two objects
    area_um2  float32 (m,), area at the finest level of detail; NaN: not known
    """

    labels: NDArray[np.uint64]
    area_um2: NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class ObjectTable:
    """All objects of a label map, n rows, in the order of the tiles that hold them.

    labels   uint64 (n,), labels of the objects, each once
    boxes    float32 (n, 6): least and largest x, y, z in um, world coordinates like the meshes'
    rows     int32 by tile: rows of the objects in a tile's meshes, in the order in which the meshes
             number them (Mesh.objects). A cut object has pieces in several tiles, and one row
    columns  the properties; `volume_um3` is always the first
    names    names for people, such as those of organs; empty: objects have no names
    default  ID of the column that colours objects at first; empty: each has a hue of its own
    interfaces     int32 (m, 2): rows of two objects with a common interface, each pair once; None:
                   not known
    interface_um2  float32 (m,), area of each interface at the finest level of detail; NaN: not
                   known
    colors   float32 (n, 3), linear RGB from the label map's file, NaN for an object without one;
             None: no object has one
    """

    labels: NDArray[np.uint64]
    boxes: NDArray[np.float32]
    rows: dict[str, NDArray[np.int32]]
    columns: tuple[Column, ...]
    names: tuple[str, ...] = ()
    default: str = ""
    interfaces: NDArray[np.int32] | None = None
    interface_um2: NDArray[np.float32] | None = None
    colors: NDArray[np.float32] | None = None

    def of_tile(self, tile: str) -> "ObjectTable":
        """Return the table of one tile's objects, in the order of its meshes' numbers."""
        rows = self.rows[tile]
        return replace(
            self,
            labels=self.labels[rows],
            boxes=self.boxes[rows],
            rows={tile: np.arange(len(rows), dtype=np.int32)},
            columns=tuple(replace(one, values=one.values[rows]) for one in self.columns),
            names=tuple(self.names[row] for row in rows.tolist()) if self.names else (),
            interfaces=None,
            interface_um2=None,
            colors=None if self.colors is None else self.colors[rows],
        )

    def touching(self, tile: str) -> SharedInterfaces:
        """Return the interfaces of a tile's objects. The first label is the tile's own object."""
        if self.interfaces is None or self.interface_um2 is None:
            return SharedInterfaces(np.zeros((0, 2), np.uint64), np.zeros(0, np.float32))
        both = np.concatenate([self.interfaces, self.interfaces[:, ::-1]])
        kept = np.isin(both[:, 0], self.rows[tile])
        return SharedInterfaces(self.labels[both[kept]], np.tile(self.interface_um2, 2)[kept])

    def column(self, column_id: str) -> Column | None:
        """Return a column by its ID; None: there is none."""
        return next((column for column in self.columns if column.id == column_id), None)
