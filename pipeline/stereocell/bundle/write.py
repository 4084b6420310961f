"""Assemble the web bundle of a composed stage, as schemas/bundle.schema.json describes it.

    manifest.json  files.json                      written last: they hold the other files' hashes
    channels/<channel>/tileset.json  volumes.json  <tile>/lodK.glb  <tile>/finer.json
                       transfer2d.json  histogram2d.ktx2
    volumes/<tile>/<channel>.ktx2  <channel>_bricks.ktx2
    luts/<channel>.ktx2
    additions.glb                                  meshes that layers add: see write_additions
    room.exr                                       light of the surroundings: see write_lights
    specimen.usdz                                  a small copy for AR viewers: see write_ar
    index.html  assets/                            the viewer

The stage is the only source. Each channel of a tile is exported separately as a part, and the parts
are kept until the bundle is complete.
"""

from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Usd

from stereocell.bundle.copy_viewer import copy_viewer
from stereocell.bundle.describe import describe_bundle, write_channel
from stereocell.bundle.gather_table import gather_table
from stereocell.bundle.manifest import FILES, MANIFEST
from stereocell.bundle.tile_part import FileRef, part_of, read_tile, write_file
from stereocell.bundle.write_additions import write_additions
from stereocell.bundle.write_ar import write_ar
from stereocell.bundle.write_lights import write_lights
from stereocell.bundle.write_objects import write_objects
from stereocell.bundle.write_tile import path_from_stage
from stereocell.formats.gltf import choose_step
from stereocell.model.errors import StageError
from stereocell.storage.file_list import encode
from stereocell.storage.workspace import move
from stereocell.usd.composed_appearance import ComposedAppearance
from stereocell.usd.layer_units import note_missing
from stereocell.usd.lost_edits import notes_on_edits, require_no_lost_edit
from stereocell.usd.read_additions import notes_on_additions
from stereocell.usd.read_appearances import read_appearances
from stereocell.usd.read_bindings import notes_on_bindings
from stereocell.usd.read_lights import (
    StageLights,
    notes_on_lights,
    read_lights,
    visible_lights,
)
from stereocell.usd.read_objects import painter_of, read_columns
from stereocell.usd.read_provenance import fingerprint_of, note_on_source
from stereocell.usd.read_stage import (
    hinted_box,
    modality_of,
    open_stage,
    opening_cut_of,
    sides_of,
    specimen_name,
    tile_prims,
)
from stereocell.usd.read_views import StageView, notes_on_rolls, read_views
from stereocell.usd.written_files import CHANGED, REMEDY, AsWritten


@dataclass(frozen=True, slots=True)
class Composed:
    """A composed stage that was opened for the export.

    appearances  appearances of all channels
    tile_ids     IDs of the visible tiles
    step_m       step of the lattice for vertices of all meshes, metres, see formats/gltf.py
    as_written   compares files with the stage's list before they are read
    """

    path: Path
    stage: Usd.Stage
    appearances: tuple[ComposedAppearance, ...]
    tile_ids: tuple[str, ...]
    step_m: float
    as_written: AsWritten = field(default_factory=AsWritten)

    @classmethod
    def open(cls, path: Path) -> "Composed":
        """Open a stage, or a layer over it. Raises StageError if it can't be shown."""
        as_written = AsWritten()
        as_written.require_layers(path.parent)
        stage = open_stage(path)
        for layer in stage.GetUsedLayers():
            if layer.realPath:
                as_written.require(Path(layer.realPath))
        appearances = tuple(read_appearances(stage))
        prims = tile_prims(stage)
        if not prims:
            raise StageError(f"{path}: found no visible tile, expected one or more: show a tile")
        boxes = [hinted_box(prim) for prim in prims]
        step_m = choose_step(float(max((high - low).max() for low, high in boxes)))
        names = tuple(str(prim.GetName()) for prim in prims)
        return cls(path, stage, appearances, names, step_m, as_written)

    def notes(self, built: Path) -> Iterator[str]:
        """Yield messages for the user about the stage.

        They are about: another specimen than that of the built stage, missing units, materials
        above the channels, missing lights, and each edit that the bundle does not take over. Raises
        StageError for an animated value.
        """
        if note := note_on_source(self.stage, built):
            yield note
        if note := note_missing(self.stage):
            yield note
        yield from notes_on_bindings(self.stage)
        yield from notes_on_edits(self.stage)
        if next(visible_lights(self.stage), None) is None:
            yield f"{self.path}: the stage has no visible light, so the viewer keeps its own lamps"
        yield from self._notes_on_parts()

    def _notes_on_parts(self) -> Iterator[str]:
        """Yield a message for each edit that is partly lost."""
        yield from notes_on_rolls(views_of(self.stage))
        yield from notes_on_additions(self.stage)
        yield from notes_on_lights(lights_of(self))

    def require_all_taken(self) -> None:
        """Raise StageError if the bundle does not take over all edits completely."""
        require_no_lost_edit(self.stage, self._notes_on_parts())


def fill_bundle(
    composed: Composed, parts: Path, root: Path, viewer_dist: Path | None
) -> Iterator[str]:
    """Write a bundle into an empty folder, and yield messages for the user.

    parts        folder of the finished parts, whose files are moved into the bundle
    viewer_dist  folder of the built viewer; None: the bundle gets no page

    The messages name layers that changed since the build and surfaces that were edited by hand, and
    give the reason if there is no specimen.usdz.
    """
    stage = composed.stage
    names = [appearance.id for appearance in composed.appearances]
    tiles = [read_tile(parts, tile_id, names) for tile_id in composed.tile_ids]
    changed = {path_from_stage(file, composed.path) for file in composed.as_written.changed}
    for name in sorted(changed.union(*(tile.changed for tile in tiles))):
        yield (
            f"{composed.path.absolute().parent / name}: {CHANGED}, and is used as it is: if nobody "
            f"edited it, remove it and {REMEDY}"
        )
    files: list[FileRef] = []
    for tile, channel in [(one, channel) for one in tiles for channel in one.channels]:
        part = part_of(parts, tile.id, channel.channel_id)
        for ref in channel.files:
            move(part / ref.path, root / ref.path)
        files += channel.files
    channels = []
    for i, appearance in enumerate(composed.appearances):
        own = [(t.id, t.channels[i]) for t in tiles]
        entry, written = write_channel(root, appearance, own)
        table = gather_table(read_columns(stage, appearance.id), own)
        if table is not None:
            index_of_objects, more = write_objects(
                root, f"channels/{appearance.id}", table, paint=painter_of(stage, appearance.id)
            )
            entry["objects"] = asdict(index_of_objects)
            written += more
        channels.append(entry)
        files += written
    added, written = _write_added(composed, root)
    files += written
    usdz, usdz_reason = write_ar(composed.path, root, composed.as_written)
    if usdz is None:
        yield f"no specimen.usdz: {usdz_reason}"
    else:
        files.append(FileRef(**usdz))
    if viewer_dist is not None:
        files += copy_viewer(viewer_dist, root)
    listed = {ref.path: {"bytes": ref.bytes, "sha256": ref.sha256} for ref in files}
    index = write_file(root, FILES, encode(listed))
    ar = {"usdz": usdz, "usdz_reason": usdz_reason}
    manifest = describe_bundle(
        _specimen_of(stage),
        tiles,
        channels=channels,
        index=index,
        more={**added, **ar},
        views=views_of(stage),
    )
    write_file(root, MANIFEST, manifest)
    for tile in tiles:
        for channel in tile.channels:
            if channel.edit:
                yield f"{tile.id}/{channel.channel_id}: {channel.edit}"


def _write_added(composed: Composed, root: Path) -> tuple[dict[str, Any], list[FileRef]]:
    """Write the meshes, curves and lights that layers add.

    Returns their entries in the manifest, and the files. Raises StageError and OutputError.
    """
    described: dict[str, Any] = {}
    files: list[FileRef] = []
    additions = write_additions(composed.stage, root)
    if additions is not None:
        described["additions"] = additions.describe()
        files.append(additions.file)
    lights = lights_of(composed)
    if lights is not None:
        described["lights"], written = write_lights(lights, root)
        files += written
    return described, files


def views_of(stage: Usd.Stage) -> list[StageView]:
    """Return the named camera views of a stage. Raises StageError for a wrong camera."""
    return list(read_views(stage, *_box_of(stage)))


def lights_of(composed: Composed) -> StageLights | None:
    """Return the lights that a user's layers edit or add; None: the viewer uses its own lamps.

    Raises StageError for values over time, and for an image that can't be read.
    """
    require = composed.as_written.require
    return read_lights(composed.stage, *_box_of(composed.stage), require)


def _box_of(stage: Usd.Stage) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lower and the upper corner (x, y, z) of the box around all tiles, world um."""
    boxes = np.array([hinted_box(prim) for prim in tile_prims(stage)])
    return boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)


def _specimen_of(stage: Usd.Stage) -> dict[str, Any]:
    """Return the manifest's entry for the specimen, without its bounds."""
    specimen: dict[str, Any] = {"name": specimen_name(stage), "modality": modality_of(stage)}
    if fingerprint := fingerprint_of(stage):
        specimen["fingerprint"] = fingerprint
    if (sides := sides_of(stage)) is not None:
        specimen["sides"] = sides
    if (cut := opening_cut_of(stage)) is not None:
        specimen["cut"] = {"normal": list(cut[0]), "offset_um": cut[1]}
    return specimen
