"""A synthetic tissue of touching cells: an image of markers, a label map, and a table of the cells.

A cell consists of the voxels that are nearest to its centre and inside a ball around it. Centres
are placed at random and then moved repeatedly to the mean of their nearest voxels (Lloyd's
algorithm). Types lie in patches, as in real tissue. A dye of nuclei fills the inner part of each
cell. Each marker fills a cell at the level of the cell's type, and is brighter at the membrane. The
table has each cell's type and marker levels before blur and noise: the ground truth.
"""

import csv
import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree
from zarr.abc.buffer import Buffer
from zarr.codecs import ZstdCodec
from zarr.storage import MemoryStore

from stereocell.model.errors import UsageError
from stereocell.samples.place import EXPECTED, SAMPLE, find_group, is_there
from stereocell.storage.atomic_write import replacing_folder, write_bytes
from stereocell.storage.overwriting import require_free

SUFFIX = ".ome.zarr"
SHAPE = (44, 176, 264)  # voxels (z, y, x)
SPACING_UM = (1.0, 0.5, 0.5)  # (z, y, x)
CELLS = 300
RADIUS_UM = 7.5  # um, radius of the ball that contains a cell
LABELS = "cells"
TYPES = ("tumour", "T cell", "B cell", "macrophage")
_SHARES = (0.45, 0.25, 0.18, 0.12)  # share of each type among the cells
NUCLEI = "DNA"
# Level of each marker in each type, in the order of TYPES; 1 is a channel's full brightness.
MARKERS = {
    "panCK": (1.0, 0.05, 0.05, 0.1),
    "Ki67": (0.6, 0.2, 0.15, 0.05),
    "CD3": (0.03, 1.0, 0.05, 0.05),
    "CD4": (0.03, 0.6, 0.05, 0.3),
    "CD8": (0.03, 0.7, 0.03, 0.03),
    "CD20": (0.03, 0.05, 1.0, 0.05),
    "CD45": (0.05, 0.8, 0.9, 0.7),
    "CD68": (0.05, 0.05, 0.05, 1.0),
    "CD163": (0.03, 0.03, 0.03, 0.7),
    "PDL1": (0.4, 0.1, 0.1, 0.5),
    "HLADR": (0.15, 0.2, 0.8, 0.9),
    "SOX10": (0.7, 0.02, 0.02, 0.02),
}
_COLUMNS = ("CellID", "cell_type", *MARKERS)  # columns of the table
_HEAD = ",".join(_COLUMNS) + "\n"  # first line of the table
_FULL, _OFFSET, _NOISE = 3000.0, 120.0, 18.0  # counts: full brightness, dark voxel, sigma of noise
_MEMBRANE_UM = 0.8  # um, thickness of the membrane
_INSIDE = 0.35  # brightness of a marker inside a cell, as a share of the brightness at the membrane
_BLUR_UM = 0.45  # um, sigma of the blur
_LLOYD = 4  # rounds of Lloyd's algorithm


@dataclass(frozen=True, slots=True)
class CellTissue:
    """The ground truth of the sample: positions, types and marker levels of n cells.

    labels   uint32 (z, y, x), 1 to n; 0 between cells
    centres  float64 (n, 3), um, (z, y, x)
    types    int64 (n,), indices in TYPES
    levels   float64 (n, markers), brightness of each marker, from 0; 1 is the channel's full one
    """

    labels: NDArray[np.uint32]
    centres: NDArray[np.float64]
    types: NDArray[np.int64]
    levels: NDArray[np.float64]


def write_cells(path: Path, *, seed: int = 1, shape: tuple[int, int, int] = SHAPE) -> None:
    """Write the sample to `path` (NAME.ome.zarr), and its table to NAME.csv beside it.

    shape  voxels (z, y, x); the number of cells is proportional to the volume

    An existing equal sample stays. Raises UsageError for another ending, OutputError if another
    file lies at the sample's or the table's path, or they can't be written.
    """
    if not path.name.endswith(SUFFIX):
        raise UsageError(f"{path}: the sample is an OME-Zarr, expected a name like NAME{SUFFIX}")
    _require_free(path, seed, shape)
    tissue = make_tissue(shape, seed)
    files, table = _zarr_files(tissue, seed), _table(tissue).encode()
    has_volume, has_table = is_there(path, files), is_there(table_beside(path), table)
    if not has_volume:
        with replacing_folder(path) as folder:
            for name, content in files.items():
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                (folder / name).write_bytes(content)
    if not has_table:
        write_bytes(table_beside(path), table)


def _require_free(path: Path, seed: int, shape: tuple[int, int, int]) -> None:
    """Raise OutputError if another volume or table exists, before the sample is computed.

    A volume is recognised by its attributes, which state the sample's arguments. A table is
    recognised by its first line.
    """
    group = find_group(path)
    is_ours = group is not None and group.attrs.get(SAMPLE) == _about(seed, shape)
    require_free(path, expected=EXPECTED, is_ours=is_ours)
    table = table_beside(path)
    require_free(table, expected=EXPECTED, is_ours=_is_table(table))


def _is_table(file: Path) -> bool:
    """Return whether a file begins like the table of this sample."""
    if not file.is_file():
        return False
    with file.open("rb") as opened:
        return opened.readline(len(_HEAD)) == _HEAD.encode()


def _about(seed: int, shape: tuple[int, int, int]) -> dict[str, Any]:
    """Return the sample's arguments for the volume's attributes."""
    return {"name": "cells", "seed": seed, "shape": list(shape)}


def table_beside(path: Path) -> Path:
    """Return the path of a sample's table."""
    return path.with_name(path.name.removesuffix(SUFFIX) + ".csv")


def make_tissue(shape: tuple[int, int, int], seed: int) -> CellTissue:
    """Return the cells in a box of voxels (z, y, x). The same seed gives the same cells."""
    rng = np.random.default_rng([seed, 77])
    spacing = np.array(SPACING_UM)
    box = (np.array(shape) - 1) * spacing
    count = max(2, round(CELLS * float(np.prod(shape)) / float(np.prod(SHAPE))))
    margin = np.minimum(RADIUS_UM - 1.5, box / 4)
    centres = rng.uniform(margin, box - margin, (count, 3))
    grid = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1) * spacing
    points = grid.reshape(-1, 3)
    inside = ((points >= margin) & (points <= box - margin)).all(axis=1)
    for _ in range(_LLOYD):
        nearest = cKDTree(centres).query(points[inside])[1]
        for axis in range(3):
            sums = np.bincount(nearest, points[inside][:, axis], count)
            centres[:, axis] = sums / np.maximum(np.bincount(nearest, minlength=count), 1)
    distance, nearest = cKDTree(centres).query(points)
    labels = np.where(distance <= RADIUS_UM, nearest + 1, 0).astype(np.uint32).reshape(shape)
    types = _types(centres, rng)
    by_type = np.array(list(MARKERS.values())).T[types]
    levels = by_type * rng.lognormal(0.0, 0.25, by_type.shape)
    return CellTissue(labels, centres, types, levels)


def _types(centres: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.int64]:
    """Return the cells' types: patches along a fixed wave in space, mixed a little at random."""
    wave = np.sin(centres @ np.array([0.03, 0.055, 0.04])) + np.cos(centres[:, 2] * 0.05)
    rank = np.argsort(np.argsort(wave + rng.normal(0, 0.35, len(centres)))) / len(centres)
    return np.searchsorted(np.cumsum(_SHARES)[:-1], rank, side="right")


def _zarr_files(tissue: CellTissue, seed: int) -> dict[str, bytes]:
    """Return the contents of the OME-Zarr's files by their relative paths."""
    buffers: dict[str, Buffer] = {}
    _write_zarr(MemoryStore(buffers), tissue, seed)
    return {name: buffer.to_bytes() for name, buffer in sorted(buffers.items())}


def _write_zarr(store: MemoryStore, tissue: CellTissue, seed: int) -> None:
    names = (NUCLEI, *MARKERS)
    shape = tissue.labels.shape
    scale: list[Any] = [{"type": "scale", "scale": [1.0, *SPACING_UM]}]
    group = zarr.open_group(store, mode="w", zarr_format=3)
    axes = [{"name": "c", "type": "channel"}, *_axes()]
    about: dict[str, Any] = {
        "version": "0.5",
        "multiscales": [
            {
                "axes": axes,
                "datasets": [{"path": "0", "coordinateTransformations": scale}],
                "name": "cells",
            }
        ],
        "omero": {"channels": [{"label": name, "active": True} for name in names]},
    }
    group.attrs["ome"] = about
    group.attrs[SAMPLE] = _about(seed, shape)
    array = group.create_array(
        "0",
        shape=(len(names), *shape),
        chunks=(1, *shape),
        dtype="uint16",
        compressors=ZstdCodec(level=3),
    )
    depth = _depth(tissue.labels)
    for index in range(len(names)):
        array[index] = _record(tissue, depth, index, seed)
    held = group.create_group("labels")
    held.attrs["ome"] = {"version": "0.5", "labels": [LABELS]}
    labels = held.create_group(LABELS)
    labels.attrs["ome"] = {
        "version": "0.5",
        "multiscales": [
            {
                "axes": _axes(),
                "datasets": [
                    {
                        "path": "0",
                        "coordinateTransformations": [{"type": "scale", "scale": list(SPACING_UM)}],
                    }
                ],
                "name": LABELS,
            }
        ],
        "image-label": {"version": "0.5", "source": {"image": "../../"}},
    }
    stored = labels.create_array(
        "0", shape=shape, chunks=shape, dtype="uint32", compressors=ZstdCodec(level=3)
    )
    stored[...] = tissue.labels


def _axes() -> list[dict[str, str]]:
    return [{"name": name, "type": "space", "unit": "micrometer"} for name in "zyx"]


def _depth(labels: NDArray[np.uint32]) -> NDArray[np.float32]:
    """Return each voxel's depth in its cell, um, float32 (z, y, x); 0 outside cells."""
    at_wall = np.zeros(labels.shape, bool)
    for axis in range(3):
        ahead = np.diff(labels.astype(np.int64), axis=axis) != 0
        low, high = [slice(None)] * 3, [slice(None)] * 3
        low[axis], high[axis] = slice(None, -1), slice(1, None)
        at_wall[tuple(low)] |= ahead
        at_wall[tuple(high)] |= ahead
    return np.where(labels > 0, ndimage.distance_transform_edt(~at_wall, SPACING_UM), 0.0).astype(
        np.float32
    )


def _record(
    tissue: CellTissue, depth: NDArray[np.float32], channel: int, seed: int
) -> NDArray[np.uint16]:
    """Return a channel of the image, uint16 (z, y, x)."""
    rng = np.random.default_rng([seed, 78, channel])
    if channel == 0:
        dye = np.zeros(tissue.labels.shape, np.float32)
        deepest = ndimage.maximum(depth, tissue.labels, np.arange(len(tissue.centres) + 1))
        share = depth / np.maximum(np.asarray(deepest)[tissue.labels], 1e-6)
        dye[(share > 0.45) & (tissue.labels > 0)] = 1.0
    else:
        level = np.concatenate([[0.0], tissue.levels[:, channel - 1]]).astype(np.float32)
        at_membrane = np.where(depth <= _MEMBRANE_UM, 1.0, _INSIDE).astype(np.float32)
        dye = level[tissue.labels] * at_membrane
    blurred = ndimage.gaussian_filter(dye, _BLUR_UM / np.array(SPACING_UM))
    counts = rng.poisson(np.maximum(blurred, 0) * _FULL + _OFFSET) + rng.normal(
        0, _NOISE, dye.shape
    )
    return np.clip(np.rint(counts), 0, 65535).astype(np.uint16)


def _table(tissue: CellTissue) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_COLUMNS)
    for row, (kind, levels) in enumerate(zip(tissue.types, tissue.levels, strict=True)):
        writer.writerow([row + 1, TYPES[kind], *(f"{_FULL * level:.1f}" for level in levels)])
    return text.getvalue()
