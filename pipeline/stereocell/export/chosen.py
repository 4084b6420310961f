"""Select the channels, tiles and level of a composed stage that are exported, and read them.

Tiles are read one at a time. The stage is read as for a bundle, with all layers over it. If a
surface was edited by hand, its coarser levels are computed again. A damaged file ends the export.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pxr import Usd

from stereocell.bundle.edited_meshes import shown_lods, with_vertex_values
from stereocell.bundle.write_tile import find_bounds
from stereocell.export.options import ExportOptions, Region
from stereocell.formats.gltf import Material
from stereocell.meshes.clip import clip_mesh
from stereocell.model.errors import StageError, UsageError
from stereocell.model.mesh import Mesh
from stereocell.model.physical_size import describe_size, display_scale
from stereocell.model.world_box import move_box
from stereocell.usd.composed_appearance import ComposedAppearance
from stereocell.usd.layer_units import note_missing
from stereocell.usd.read_appearances import read_appearances
from stereocell.usd.read_levels import count_faces, mesh_at
from stereocell.usd.read_objects import TileObjects, read_columns, read_tile_objects
from stereocell.usd.read_stage import hinted_box, loaded, open_stage, tile_prims
from stereocell.usd.read_variants import TileChoice, lod_levels
from stereocell.usd.read_volume import ComposedVolume, read_volume
from stereocell.usd.written_files import AsWritten

Report = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Piece:
    """The surface of a channel in a tile, as read for an export.

    mesh     in world um; values of maps are stored at its vertices
    objects  objects of a label map's tile, which `mesh.objects` refers to
    moved    the 16 numbers, row by row, of the matrix (4, 4) for row vectors from the tile's own
             space to the world; tiles with the same matrix fit together
    cuts     planes of the faces of the tile's box, in its own space: axis of the normal, coordinate
    """

    tile: str
    channel: ComposedAppearance
    mesh: Mesh
    material: Material
    objects: TileObjects | None = None
    moved: tuple[float, ...] = ()
    cuts: tuple[tuple[int, float], ...] = ()

    @property
    def object_names(self) -> list[str]:
        """The name of each object in the tile; empty without objects.

        An object without a name is called after its channel and label.
        """
        if self.objects is None:
            return []
        names = self.objects.names or ("",) * len(self.objects.labels)
        labelled = zip(names, self.objects.labels.tolist(), strict=True)
        return [name or f"{self.channel.name} {label}" for name, label in labelled]


class Chosen:
    """The part of a stage that is exported.

    Raises UsageError for a channel or a tile that the stage does not have.
    """

    def __init__(
        self, stage_path: Path, options: ExportOptions, report: Report = lambda _: None
    ) -> None:
        self.path, self.options, self.report = stage_path, options, report
        self.as_written = AsWritten()
        self.as_written.require_layers(stage_path.parent)
        self.stage = open_stage(stage_path)
        for layer in self.stage.GetUsedLayers():
            if layer.realPath:
                self.as_written.require(Path(layer.realPath))
        if note := note_missing(self.stage):
            report(note)
        self.channels = self._channels()
        self.all_tiles = {str(prim.GetName()): hinted_box(prim) for prim in tile_prims(self.stage)}
        if not self.all_tiles:
            raise StageError(
                f"{stage_path}: found no visible tile, expected one or more: show a tile"
            )
        unknown = [name for name in options.tiles if name not in self.all_tiles]
        if unknown:
            known = ", ".join(self.all_tiles)
            raise UsageError(
                f"--tiles names {unknown[0]!r}, expected visible tiles, one or more of {known}"
            )
        self.tiles = [name for name in self.all_tiles if name in options.tiles or not options.tiles]

    @contextmanager
    def _loaded(self, name: str) -> Iterator[tuple[Usd.Prim, TileChoice]]:
        """Yield a tile and its variants as the stage selects them.

        Selections that were made to read a tile are removed afterwards.
        """
        try:
            with loaded(self.stage, name, as_written=self.as_written) as found:
                yield found
        finally:
            self.stage.GetSessionLayer().Clear()

    def _channels(self) -> list[ComposedAppearance]:
        found, wanted = read_appearances(self.stage), self.options.channels
        for name in wanted:
            if not any(name in (one.name, one.id) for one in found):
                known = ", ".join(one.name for one in found)
                raise UsageError(f"--channels names {name!r}, expected one or more of {known}")
        return [one for one in found if not wanted or one.name in wanted or one.id in wanted]

    @property
    def label_maps(self) -> list[ComposedAppearance]:
        """Return the selected channels that are label maps."""
        return [one for one in self.channels if read_columns(self.stage, one.id) is not None]

    def show_as_viewer(self) -> None:
        """Select only the channels that the viewer shows at opening, unless channels were named.

        All channels together would hide each other, or show through each other in patches. If the
        viewer's channels have no surface, all channels stay selected.
        """
        every, shown = self.channels, [one for one in self.channels if one.opens]
        if self.options.channels or not shown or len(shown) == len(every):
            return
        self.channels = shown
        if any(self.count_triangles()):
            names = ", ".join(one.name for one in shown)
            self.report(f"only {names}, as the viewer shows at opening: --channels chooses others")
        else:
            self.channels = every

    @property
    def is_part(self) -> bool:
        """Whether only some tiles or a region are exported; then additions are left out."""
        return bool(self.options.tiles) or self.region is not None

    @property
    def region(self) -> Region | None:
        return self.options.region

    @property
    def box(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the corners (x, y, z), world um, of the tiles' box, clipped to the region.

        Raises UsageError if the region does not overlap the tiles.
        """
        low, high = (np.array([self.all_tiles[tile][end] for tile in self.tiles]) for end in (0, 1))
        box = low.min(axis=0), high.max(axis=0)
        if self.region is None:
            return box
        low, high = np.maximum(box[0], self.region.low), np.minimum(box[1], self.region.high)
        if not (low < high).all():
            raise self.nothing("tile")
        return low, high

    @property
    def longest_um(self) -> float:
        """Return the longest edge of the exported part, um."""
        low, high = self.box
        return float((high - low).max())

    def describe_scale(self, scale: float) -> str:
        """Return text on the physical size of the exported part, and on its size in the file."""
        low, high = self.box
        size, shown = (describe_size((high - low) * one) for one in (1.0, scale))
        if scale != 1:
            return f"{shown}, {scale:.6g} times the specimen of {size}"
        larger = display_scale(self.longest_um)
        return f"life-size, {size}" + (f"; --scale {larger:.0f} enlarges it" if larger > 1 else "")

    def nothing(self, kind: str) -> UsageError | StageError:
        """Return the error to raise if nothing of a kind, such as a surface, is left to export.

        If there is a region, the message states the box that a region may overlap.
        """
        if self.region is None:
            return StageError(
                f"{self.path}: found no {kind} to export, expected one or more: choose other "
                "--tiles or --channels"
            )
        low, high = (np.array([self.all_tiles[tile][end] for tile in self.tiles]) for end in (0, 1))
        ends = zip(low.min(axis=0).tolist(), high.max(axis=0).tolist(), strict=True)
        box = ",".join(f"{a:.6g}:{b:.6g}" for a, b in ends)
        return UsageError(f"--region: found no {kind} in it, expected a box that overlaps {box}")

    def count_triangles(self) -> list[int]:
        """Return the number of triangles of the selected tiles and channels at each level.

        The finest level is first. Triangles outside a region do not count if --max-triangles is
        given. All surfaces must be read for that.
        """
        by_tile: list[list[int]] = []
        for name in self.tiles:
            with self._loaded(name) as (tile, choice):
                levels = range(max([*lod_levels(tile), 0]) + 1)
                counts = [self._count(tile, max(level, choice.finest_lod)) for level in levels]
                by_tile.append(counts)
        longest = max(map(len, by_tile))
        counts = [sum(n[min(level, len(n) - 1)] for n in by_tile) for level in range(longest)]
        if self.region is None or self.options.max_triangles is None:
            return counts
        return [sum(len(p.mesh.triangles) for p in self.pieces(i)) for i in range(longest)]

    def _count(self, tile: Usd.Prim, level: int) -> int:
        prims = [mesh_at(tile, channel.id, level) for channel in self.channels]
        return sum(count_faces(prim) for prim in prims if prim is not None)

    def levels(self, *, light: int | None = None) -> list[int]:
        """Return the levels to try, finest first, that meet --lod and --max-triangles.

        light  largest number of triangles if neither option is given; if all levels have more, the
               coarsest level is returned

        Raises UsageError if no level is small enough, and StageError if there is no surface.
        """
        counts = self.count_triangles()
        if not any(counts):
            channels = ", ".join(channel.name for channel in self.channels)
            raise StageError(
                f"{self.path}: found no visible surface of {channels}, expected one or more: "
                "choose other --tiles or --channels"
            )
        most, finest = self.options.max_triangles, self.options.lod
        if most is None and finest is None and light is not None:
            return [i for i, n in enumerate(counts) if n <= light] or [len(counts) - 1]
        from_here = range(min(finest or 0, len(counts) - 1), len(counts))
        levels = [i for i in from_here if most is None or counts[i] <= most]
        if not levels:
            least = min(counts)
            raise UsageError(
                f"--max-triangles is {most}, expected at least {least}, as the coarsest level of "
                "detail has: raise it, or choose fewer --tiles or --channels"
            )
        return levels

    def pieces(
        self, level: int, *, whole: bool = False, channel: str | None = None
    ) -> Iterator[Piece]:
        """Yield the surfaces at a level of detail, one tile after the other.

        whole    read all tiles and do not clip to the region, for solids that are cut later
        channel  ID of the channel to read; None: all selected channels
        """
        tiles = list(self.all_tiles) if whole else self.tiles
        for number, name in enumerate(tiles, 1):
            with self._loaded(name) as (tile, choice):
                for one in self.channels:
                    if channel not in (None, one.id):
                        continue
                    piece = self._piece(tile, one, max(level, choice.finest_lod))
                    if piece is None:
                        continue
                    if self.region is not None and not whole:
                        mesh = clip_mesh(piece.mesh, self.region.low, self.region.high)
                        piece = replace(piece, mesh=mesh)
                    if len(piece.mesh.triangles):
                        yield piece
            self.report(f"{number}/{len(tiles)} {name}" + (f"/{channel}" if channel else ""))

    def _piece(self, tile: Usd.Prim, channel: ComposedAppearance, level: int) -> Piece | None:
        shown = shown_lods(tile, channel.id)
        if shown.edit:
            self.report(f"{tile.GetName()}/{channel.id}: {shown.edit}")
        lods = [lod for lod in shown.lods if len(lod.mesh.triangles)]
        if not lods:
            return None
        finer = [lod for lod in lods if lod.level <= level]
        lod = finer[-1] if finer else lods[0]
        for image in lod.maps.files:
            self.as_written.require(image)
        mesh = with_vertex_values(lod.mesh, lod.images or lod.maps)
        described = read_columns(self.stage, channel.id) if mesh.objects is not None else None
        prim = mesh_at(tile, channel.id, lod.level)
        objects = None
        if described is not None and prim is not None:
            objects = read_tile_objects(prim, described[0])
        if objects is None:
            mesh = replace(mesh, objects=None)
        moved = tuple(np.round(lod.matrix, 9).ravel().tolist())
        ends = self._own_box(tile, channel, lod.matrix)
        cuts = tuple((axis, float(end[axis])) for axis in range(3) for end in ends)
        return Piece(str(tile.GetName()), channel, mesh, lod.material, objects, moved, cuts)

    def _own_box(
        self, tile: Usd.Prim, channel: ComposedAppearance, matrix: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the corners (x, y, z) of a tile's box, um, in the tile's own space."""
        volume = read_volume(tile, channel.id)
        if volume is not None:
            return np.array(volume.low), np.array(volume.high)
        low, high = self.all_tiles[str(tile.GetName())]
        return move_box(low, high, np.linalg.inv(matrix).astype(np.float64))

    def volumes(self) -> Iterator[tuple[str, ComposedAppearance, ComposedVolume]]:
        """Yield the volumes with their tile and channel, one tile after the other."""
        for number, name in enumerate(self.tiles, 1):
            with self._loaded(name) as (tile, _):
                for channel in self.channels:
                    volume = read_volume(tile, channel.id)
                    if volume is not None:
                        yield name, channel, volume
            self.report(f"{number}/{len(self.tiles)} {name}")

    def tile_boxes(self) -> dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Return the corners (x, y, z) of each visible tile, world um, where neighbours meet."""
        boxes = {}
        for name in self.all_tiles:
            with self._loaded(name) as (tile, _):
                low, high = find_bounds(tile, [read_volume(tile, c.id) for c in self.channels])
                boxes[name] = np.array(low), np.array(high)
        return boxes
