"""Write a folder for Neuroglancer, NAME.precomputed: the image, and surfaces at all levels.

    image/    all channels with volumes, at several scales
    mesh/     one segment per channel: 1, 2, ...
    CHANNEL/  for a label map: one segment per object; its ID is the label

In Neuroglancer, voxel (0, 0, 0) spans 0 to 1 along each axis. The format has no rotated volumes. So
the image of a rotated specimen keeps its own axes, and meshes are rotated back onto them.
"""

import tempfile
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.export.chosen import Chosen
from stereocell.export.options import UNITS_M
from stereocell.export.unite import weld
from stereocell.export.voxels import (
    Layout,
    fill,
    find_layout,
    map_file,
    map_zeros,
    places_of_world,
)
from stereocell.formats.precomputed import (
    CHUNK,
    Level,
    write_mesh,
    write_meshes_info,
    write_volume,
)
from stereocell.model.errors import StageError
from stereocell.model.extra_packages import import_extra
from stereocell.objects.split import split_objects
from stereocell.usd.layer import METERS_PER_UNIT

_NM = 1e-9  # metres
Surface = tuple[NDArray[np.float32], NDArray[np.uint32]]


def write_precomputed(chosen: Chosen, path: Path, _: int) -> str:
    """Write the folder; return a sentence about it. Raises UsageError without DracoPy."""
    draco = import_extra("DracoPy", extra="draco", wanted_by=path.suffix)
    path.mkdir()
    layout = find_layout(chosen) if _has_volumes(chosen) else None
    written = []
    if layout is not None:
        count = _write_image(path / "image", chosen, layout)
        written.append(f"image: {layout.about}, {count} scales")
    to_nm = _places(chosen, layout)
    levels = len(chosen.count_triangles())
    channels: dict[int, str] = {}
    for number, channel in enumerate(chosen.channels, 1):
        found = _gather(chosen, channel.id, levels)
        if not found.surfaces:
            continue
        folder = path / (channel.id if found.names else "mesh")
        folder.mkdir(exist_ok=True)
        for segment, by_level in found.surfaces.items():
            made = [_level(parts, to_nm) for parts in by_level if parts]
            write_mesh(folder, segment or number, _different(made), draco.encode)
        if found.names:
            write_meshes_info(folder, found.names)
            written.append(f"{folder.name}: {len(found.names)} meshes")
        else:
            channels[number] = channel.name
    if channels:
        write_meshes_info(path / "mesh", channels)
        written.append(f"mesh: {', '.join(channels.values())}, up to {levels} levels of detail")
    if not written:
        raise StageError(
            f"{chosen.path}: found no volume and no surface to export, expected one or more: "
            "choose other --tiles or --channels"
        )
    return "; ".join(written)


@dataclass(slots=True)
class _Found:
    """The surfaces of a channel in all tiles and at all levels of detail.

    surfaces  by segment ID, for each level the surfaces of all tiles; the ID is 0 if the channel is
              not a label map
    names     name of each segment of a label map
    """

    surfaces: dict[int, list[list[Surface]]] = field(default_factory=dict)
    names: dict[int, str] = field(default_factory=dict)


def _gather(chosen: Chosen, channel_id: str, levels: int) -> _Found:
    found = _Found()
    for level in range(levels):
        for piece in chosen.pieces(level, channel=channel_id):
            mesh, objects = piece.mesh, piece.objects
            parts = [(0, mesh)]
            if objects is not None and mesh.objects is not None:
                labels, names = objects.labels.tolist(), piece.object_names
                parts = [(labels[number], part) for number, part in split_objects(mesh)]
                found.names |= dict(zip(labels, names, strict=True))
            for segment, part in parts:
                kept = found.surfaces.setdefault(segment, [[] for _ in range(levels)])
                kept[level].append((part.positions, part.triangles))
    return found


def _level(parts: list[Surface], to_nm: NDArray[np.float64]) -> Level:
    """Join surfaces of several tiles to one mesh.

    to_nm  matrix (4, 4) for column vectors, from world um to Neuroglancer's nm
    """
    positions, triangles = weld(parts)
    places = positions.astype(np.float64) @ to_nm[:3, :3].T + to_nm[:3, 3]
    if np.linalg.det(to_nm[:3, :3]) < 0:
        triangles = np.ascontiguousarray(triangles[:, ::-1])
    return Level(places, triangles)


def _different(levels: list[Level]) -> list[Level]:
    """Return levels of detail, finest first, without those that repeat a finer one's triangles."""
    kept = levels[:1]
    for level in levels[1:]:
        if len(level.triangles) < len(kept[-1].triangles):
            kept.append(level)
    return kept


def _has_volumes(chosen: Chosen) -> bool:
    return next(iter(chosen.volumes()), None) is not None


def _places(chosen: Chosen, layout: Layout | None) -> NDArray[np.float64]:
    """Return the matrix (4, 4) for column vectors from world um to nm in Neuroglancer's space."""
    to_source = np.eye(4)
    to_source[:3, :3] = places_of_world(chosen)
    if layout is None:
        to_source[:3] *= METERS_PER_UNIT / _NM
        return to_source
    grid = layout.grid
    to_source[:3] *= METERS_PER_UNIT / UNITS_M[grid.unit]
    to_index = np.linalg.inv(grid.affine) @ to_source
    to_index[:3, 3] += 0.5  # voxel k spans k to k + 1, so its centre is at k + 0.5
    return np.diag([*_resolution(layout), 1.0]) @ to_index


def _resolution(layout: Layout) -> tuple[float, float, float]:
    """Return the voxel spacing (x, y, z) in nm."""
    x, y, z = np.round(layout.grid.spacing * UNITS_M[layout.grid.unit] / _NM, 6).tolist()
    return x, y, z


def _write_image(folder: Path, chosen: Chosen, layout: Layout) -> int:
    """Write the image of all channels; return the number of its scales (resolution levels).

    Each scale is computed from the one before. They are stored in temporary files.
    """
    with tempfile.TemporaryDirectory(dir=folder.parent) as scratch:
        file = Path(scratch) / "0"
        file.touch()
        values = map_file(file, layout, 0)
        fill(layout, chosen, values)
        scales = [(values, _resolution(layout))]
        while max(scales[-1][0].shape[1:]) > CHUNK:
            scales.append(_halved(*scales[-1], Path(scratch) / str(len(scales))))
        write_volume(folder, scales)
        count = len(scales)
        del values, scales  # some systems do not remove files that are still mapped
        return count


def _halved(
    values: NDArray[Any], spacing: tuple[float, float, float], file: Path
) -> tuple[NDArray[Any], tuple[float, float, float]]:
    """Return voxels at half the resolution, as means of two, and their spacing.

    Axes whose spacing is much coarser than the finest one are not halved.
    """
    factors = [
        2 if s < 1.5 * min(spacing) and n > 1 else 1
        for s, n in zip(spacing, values.shape[:0:-1], strict=True)
    ]
    fx, fy, fz = factors
    shape = (
        len(values),
        *(-(-n // f) for n, f in zip(values.shape[1:], (fz, fy, fx), strict=True)),
    )
    file.touch()
    made = map_zeros(file, values.dtype, shape)
    for channel, z in product(range(shape[0]), range(shape[1])):
        slab = values[channel, z * fz : (z + 1) * fz].astype(np.float32).mean(axis=0)
        padded = np.pad(slab, [(0, -slab.shape[0] % fy), (0, -slab.shape[1] % fx)], mode="edge")
        blocks = padded.reshape(shape[2], fy, shape[3], fx)
        made[channel, z] = np.rint(blocks.mean(axis=(1, 3))).astype(values.dtype)
    sx, sy, sz = spacing
    return made, (sx * fx, sy * fy, sz * fz)
