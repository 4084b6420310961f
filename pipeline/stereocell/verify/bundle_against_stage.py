"""Compare a bundle with the stage that it was exported from, in decoded files.

Each channel of each tile is a task of its own, so that a single tile occupies several workers.

The comparisons are in bundle_manifest, bundle_surfaces and bundle_volumes.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pxr import Usd

from stereocell.bundle.edited_meshes import shown_lods
from stereocell.bundle.manifest import read_manifest
from stereocell.bundle.windowed_voxels import read_windowed
from stereocell.bundle.write_tile import find_bounds
from stereocell.bundle.write_transfer2d import count_tile
from stereocell.usd.composed_appearance import ComposedAppearance
from stereocell.usd.read_appearances import read_appearances
from stereocell.usd.read_stage import loaded, open_stage
from stereocell.usd.read_variants import TileChoice
from stereocell.usd.read_volume import ComposedVolume, read_volume
from stereocell.verify.bundle_files import find_differences
from stereocell.verify.bundle_surfaces import compare_surfaces, surfaces_of
from stereocell.verify.bundle_volumes import compare_volume, find_volume, placement_of


@dataclass(frozen=True, slots=True)
class BundleTask:
    """A part of a bundle, and the stage that it was exported from.

    channel_id  channel whose surfaces and volume in the tile are compared; None: the tile's own
                entry in the manifest is compared
    """

    stage_file: Path
    bundle: Path
    tile_id: str
    channel_id: str | None


@dataclass(frozen=True, slots=True)
class PartFinding:
    """The result of comparing a part of a bundle with the stage.

    worst   largest distance of a vertex from its position in the stage, in lattice steps
    edit    a line on the surface, if it was edited by hand; otherwise empty
    joints  the volume's joint histogram of value and gradient, packed, by channel; empty without a
            volume
    """

    problems: tuple[str, ...]
    surfaces: int = 0
    worst: float = 0.0
    edit: str = ""
    joints: Mapping[str, bytes] = field(default_factory=dict)


def bundle_tasks(stage_file: Path, bundle: Path, tiles: Sequence[str]) -> Iterator[BundleTask]:
    """Yield the parts of a bundle: for each tile its entry, and each channel of the manifest.

    The check of the manifest reports channels that are only in the stage or only in the manifest.
    """
    listed = {channel["id"] for channel in read_manifest(bundle)["channels"]}
    channels = [one.id for one in read_appearances(open_stage(stage_file)) if one.id in listed]
    for tile_id in tiles:
        for channel_id in (None, *channels):
            yield BundleTask(stage_file, bundle, tile_id, channel_id)


def compare_part(task: BundleTask) -> PartFinding:
    """Compare a part's files with the composed stage. Raises StereoCellError if unreadable."""
    manifest = read_manifest(task.bundle)
    stage = open_stage(task.stage_file)
    appearances = {one.id: one for one in read_appearances(stage)}
    with loaded(stage, task.tile_id) as (tile, choice):
        if task.channel_id is None:
            listed = {channel["id"] for channel in manifest["channels"]}
            volumes = [read_volume(tile, one) for one in appearances if one in listed]
            return PartFinding(_compare_entry(task.tile_id, manifest, tile, choice, volumes))
        channel = next(one for one in manifest["channels"] if one["id"] == task.channel_id)
        return _compare_channel(task, channel, appearances[task.channel_id], tile, choice)


def _compare_entry(
    tile_id: str,
    manifest: dict[str, Any],
    tile: Usd.Prim,
    choice: TileChoice,
    volumes: Sequence[ComposedVolume | None],
) -> tuple[str, ...]:
    listed = next((one for one in manifest["tiles"] if one["id"] == tile_id), None)
    if listed is None:
        return ()
    low, high = find_bounds(tile, volumes)
    bounds = {"min": list(low), "max": list(high)}
    expected = {"representation": choice.representation, "bounds_um": bounds}
    return tuple(find_differences(tile_id, listed, expected))


def _compare_channel(
    task: BundleTask,
    channel: dict[str, Any],
    appearance: ComposedAppearance,
    tile: Usd.Prim,
    choice: TileChoice,
) -> PartFinding:
    name = f"{task.tile_id}/{appearance.id}"
    shown = shown_lods(tile, appearance.id, choice.finest_lod)
    contents = dict(surfaces_of(task.bundle, channel, task.tile_id))
    worst, faults = compare_surfaces(contents, {lod.level: lod for lod in shown.lods})
    problems, joints = [f"{name}: {fault}" for fault in faults], {}
    composed = read_volume(tile, appearance.id)
    entry = find_volume(task.bundle, channel, task.tile_id)
    if (composed is None) != (entry is None):
        which = ("stage", "bundle") if composed is None else ("bundle", "stage")
        problems.append(f"{name}: the {which[0]} has no volume, but the {which[1]} has one")
    elif composed is not None and entry is not None:
        problems += find_differences(name, entry, placement_of(composed))
        voxels = read_windowed(composed, appearance)
        problems += [f"{name}: {fault}" for fault in compare_volume(task.bundle, entry, voxels)]
        joints[appearance.id] = count_tile(voxels, composed, appearance.transfer_2d.gradient_max)
    edit = f"{name}: {shown.edit}" if shown.edit else ""
    return PartFinding(tuple(problems), len(contents), worst, edit, joints)
