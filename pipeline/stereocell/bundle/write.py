"""Write the web bundle of a composed stage, as schemas/bundle.schema.json describes it.

    manifest.json  files.json                      written last: they hash all others
    channels/<channel>/tileset.json  volumes.json  <tile>/lodK.glb  <tile>/finer.json
                       transfer2d.json  histogram2d.ktx2
    volumes/<tile>/<channel>.ktx2  <channel>_bricks.ktx2
    luts/<channel>.ktx2
    specimen.usdz                                  its surfaces, small: see write_ar
    index.html  assets/                            the viewer

The stage is the only source. Tiles are exported each by itself, as parts that stay until the bundle
is whole; it is put together beside its place and put there as a whole.
"""

import shutil
from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, Protocol, TypeVar

from stereocell.bundle.copy_viewer import copy_viewer
from stereocell.bundle.describe import describe_bundle, write_channel
from stereocell.bundle.gather_table import gather_table
from stereocell.bundle.manifest import FILES, MANIFEST, require_bundle
from stereocell.bundle.tile_part import FileRef, find_part, write_file
from stereocell.bundle.write_ar import write_ar
from stereocell.bundle.write_objects import write_objects
from stereocell.bundle.write_tile import export_tile
from stereocell.formats.gltf import choose_step
from stereocell.model.errors import OutputError, StageError
from stereocell.storage.atomic_write import replacing_folder
from stereocell.storage.file_list import encode
from stereocell.storage.workspace import move
from stereocell.usd.layer_units import note_missing
from stereocell.usd.read_appearances import read_appearances
from stereocell.usd.read_bindings import notes_on_bindings
from stereocell.usd.read_objects import painter_of, read_columns
from stereocell.usd.read_provenance import fingerprint_of
from stereocell.usd.read_stage import (
    hinted_box,
    modality_of,
    open_stage,
    opening_cut_of,
    sides_of,
    specimen_name,
    tile_prims,
)
from stereocell.usd.typed_values import usd_boundary
from stereocell.usd.written_files import CHANGED, REMEDY, AsWritten

T = TypeVar("T")
R = TypeVar("R")
_ReportLine = Callable[[str], None]


class Run(Protocol):
    """Run a function over named tasks and return their results, as `Engine.run` does."""

    def __call__(
        self, label: str, function: Callable[[T], R], tasks: Sequence[tuple[str, T]], /
    ) -> list[R]: ...


def write_bundle(
    stage_path: Path,
    bundle_dir: Path,
    viewer_dist: Path | None,
    *,
    run: Run,
    parts: Path | None = None,
    report_line: _ReportLine = lambda _: None,
) -> None:
    """Write the bundle of a stage, or of a layer over it, in place of an older one.

    viewer_dist  the built viewer, copied into the bundle; None: no viewer
    run          how the tiles are shared among workers; the bytes don't depend on their number
    parts        a folder for the tiles that are finished, of this very stage: those that are in it
                 are taken, and all are left there; None: none are kept if this does not end well
    report_line  is given a line on each layer that is not as it was written, on each surface that
                 was edited by hand, on each material that is bound above the channels, and on units
                 that the layer does not state

    Raises StageError where the stage lacks something or a file of it is damaged, naming prim and
    file (TasksFailedError where a tile does); OutputError where `bundle_dir` can't be written, or
    is something else.
    """
    require_bundle(bundle_dir)
    if viewer_dist is not None and not (viewer_dist / "index.html").is_file():
        raise OutputError(f"{viewer_dist}: no index.html, expected the built viewer")
    with usd_boundary(stage_path), replacing_folder(bundle_dir) as folder:
        _fill(stage_path, folder, viewer_dist, run, parts or folder / ".parts", report_line)
        shutil.rmtree(folder / ".parts", ignore_errors=True)


def _fill(
    stage_path: Path,
    root: Path,
    viewer_dist: Path | None,
    run: Run,
    parts: Path,
    report_line: _ReportLine,
) -> None:
    as_written = AsWritten()
    as_written.require_layers(stage_path.parent)
    stage = open_stage(stage_path)
    for layer in stage.GetUsedLayers():
        if layer.realPath:
            as_written.require(Path(layer.realPath))
    if note := note_missing(stage):
        report_line(note)
    for note in notes_on_bindings(stage):
        report_line(note)
    appearances = read_appearances(stage)
    prims = tile_prims(stage)
    if not prims:
        raise StageError(f"{stage_path}: no tile is visible")
    boxes = [hinted_box(prim) for prim in prims]
    step_m = choose_step(float(max((high - low).max() for low, high in boxes)))
    export = partial(
        export_tile,
        stage_path,
        parts,
        appearances=tuple(appearances),
        step_m=step_m,
    )
    names = [str(prim.GetName()) for prim in prims]
    found = {name: find_part(parts / name) for name in names}
    missing = [name for name in names if found[name] is None]
    exported = run("bundle", export, [(name, name) for name in missing])
    found |= dict(zip(missing, [tile for tile, _ in exported], strict=True))
    for layer_path in sorted(as_written.changed.union(*(changed for _, changed in exported))):
        report_line(
            f"{layer_path}: {CHANGED}: taken as it is; if nobody edited it, remove it and {REMEDY}"
        )
    tiles = [tile for tile in found.values() if tile is not None]
    files = []
    for tile in tiles:
        refs = [ref for channel in tile.channels for ref in channel.files]
        for ref in refs:
            move(parts / tile.id / ref.path, root / ref.path)
        files += refs
    channels = []
    for i, appearance in enumerate(appearances):
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
    usdz, usdz_reason = write_ar(stage_path, root, as_written)
    if usdz is None:
        report_line(f"no specimen.usdz: {usdz_reason}")
    else:
        files.append(FileRef(**usdz))
    if viewer_dist is not None:
        files += copy_viewer(viewer_dist, root)
    listed = {ref.path: {"bytes": ref.bytes, "sha256": ref.sha256} for ref in files}
    index = write_file(root, FILES, encode(listed))
    specimen: dict[str, Any] = {"name": specimen_name(stage), "modality": modality_of(stage)}
    if fingerprint := fingerprint_of(stage):
        specimen["fingerprint"] = fingerprint
    if (sides := sides_of(stage)) is not None:
        specimen["sides"] = sides
    if (cut := opening_cut_of(stage)) is not None:
        specimen["cut"] = {"normal": list(cut[0]), "offset_um": cut[1]}
    ar = {"usdz": usdz, "usdz_reason": usdz_reason}
    manifest = describe_bundle(specimen, tiles, channels=channels, index=index, ar=ar)
    write_file(root, MANIFEST, manifest)
    for tile in tiles:
        for channel in tile.channels:
            if channel.edit:
                report_line(f"{tile.id}/{channel.channel_id}: {channel.edit}")
