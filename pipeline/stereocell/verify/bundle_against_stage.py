"""Compare a bundle with the stage that it was exported from, tile by tile, in decoded files.

The comparisons are in bundle_manifest, bundle_surfaces and bundle_volumes.
"""

from dataclasses import dataclass
from pathlib import Path

from stereocell.bundle.edited_meshes import shown_lods
from stereocell.bundle.manifest import read_manifest
from stereocell.bundle.windowed_voxels import read_windowed
from stereocell.bundle.write_tile import find_bounds
from stereocell.bundle.write_transfer2d import count_tile
from stereocell.usd.read_appearances import read_appearances
from stereocell.usd.read_stage import loaded, open_stage
from stereocell.usd.read_volume import read_volume
from stereocell.verify.bundle_files import find_differences
from stereocell.verify.bundle_surfaces import compare_surfaces, surfaces_of, without_repeats
from stereocell.verify.bundle_volumes import compare_volume, find_volume, placement_of


@dataclass(frozen=True, slots=True)
class BundleTask:
    """One tile of a bundle, and the stage that it was exported from."""

    stage_file: Path
    bundle: Path
    tile_id: str


@dataclass(frozen=True, slots=True)
class TileFinding:
    """The result of comparing one tile of a bundle with the stage.

    worst   largest distance of a vertex from its position in the stage, in lattice steps
    edits   a line for each surface that was edited by hand
    joints  each volume's joint histogram of value and gradient, packed, by channel
    """

    name: str
    surfaces: int
    volumes: int
    worst: float
    joints: dict[str, bytes]
    problems: tuple[str, ...]
    edits: tuple[str, ...] = ()


def compare_tile(task: BundleTask) -> TileFinding:
    """Compare one tile's files with the composed stage. Raises StereoCellError if unreadable."""
    manifest = read_manifest(task.bundle)
    channels = {channel["id"]: channel for channel in manifest["channels"]}
    problems: list[str] = []
    edits: list[str] = []
    joints: dict[str, bytes] = {}
    surfaces = 0
    worst = 0.0
    stage = open_stage(task.stage_file)
    # The check of the manifest reports channels that the manifest lacks.
    appearances = [
        appearance for appearance in read_appearances(stage) if appearance.id in channels
    ]
    listed = next((one for one in manifest["tiles"] if one["id"] == task.tile_id), None)
    with loaded(stage, task.tile_id) as (tile, choice):
        volumes = [read_volume(tile, appearance.id) for appearance in appearances]
        if listed is not None:
            low, high = find_bounds(tile, volumes)
            bounds = {"min": list(low), "max": list(high)}
            expected = {"representation": choice.representation, "bounds_um": bounds}
            problems += find_differences(task.tile_id, listed, expected)
        for appearance, composed in zip(appearances, volumes, strict=True):
            channel, name = channels[appearance.id], f"{task.tile_id}/{appearance.id}"
            shown = shown_lods(tile, appearance.id, choice.finest_lod)
            lods = dict(without_repeats(shown.lods))
            edits += [f"{name}: {shown.edit}"] if shown.edit else []
            contents = dict(surfaces_of(task.bundle, channel, task.tile_id))
            surfaces += len(contents)
            apart, faults = compare_surfaces(contents, lods)
            worst = max(worst, apart)
            problems += [f"{name}: {fault}" for fault in faults]
            entry = find_volume(task.bundle, channel, task.tile_id)
            if (composed is None) != (entry is None):
                which = ("stage", "bundle") if composed is None else ("bundle", "stage")
                problems.append(f"{name}: the {which[0]} has no volume, but the {which[1]} has one")
            elif composed is not None and entry is not None:
                problems += find_differences(name, entry, placement_of(composed))
                voxels = read_windowed(composed, appearance)
                problems += [
                    f"{name}: {fault}" for fault in compare_volume(task.bundle, entry, voxels)
                ]
                joints[appearance.id] = count_tile(
                    voxels, composed, appearance.transfer_2d.gradient_max
                )
    return TileFinding(
        task.tile_id, surfaces, len(joints), worst, joints, tuple(problems), tuple(edits)
    )
