"""Write the first view of a source: a bundle of coarse volumes, without surfaces.

The bundle has the same tiles, channels and kinds of files as the bundle of a build. The same code
writes it, by the same schema, so that every viewer of bundles shows it. Only its voxels are coarse.
"""

from collections.abc import Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from stereocell.bundle.describe import describe_bundle, write_channel
from stereocell.bundle.manifest import FILES, MANIFEST
from stereocell.bundle.tile_part import BundleTile, FileRef, write_file
from stereocell.live.coarse_channel import CoarseChannel, OnRead, read_coarse
from stereocell.live.coarse_labels import read_coarse_labels
from stereocell.live.coarse_tiles import Sizes, write_coarse_tiles
from stereocell.live.first_appearance import first_appearance
from stereocell.model.channel import DEFAULT_FUNCTION, Appearance
from stereocell.planning.channels import Channel
from stereocell.planning.object_tables import appearance_of_labels
from stereocell.planning.plan import Plan
from stereocell.read import Dataset
from stereocell.storage.file_list import encode
from stereocell.storage.processes import cores
from stereocell.transfer.opacity import SHARP, SOFT, SURFACE
from stereocell.usd.composed_appearance import ComposedAppearance, StatedLevel
from stereocell.usd.opening import PATIENT_SIDES, opening_plane

# Most coarse voxels of a source, all channels together.
VOXELS = 4_000_000
NOT_BUILT = "its surface is not built yet"
OBJECTS_NOT_BUILT = "its objects are not built yet"


def read_channels(
    plan: Plan, dataset: Dataset, on_read: OnRead = lambda share: None
) -> dict[str, CoarseChannel]:
    """Return the coarse voxels of a plan's channels, by `Channel.voxels_id`.

    Two surfaces of one channel of the source share that ID, so their voxels are read once.

    on_read  called from any thread after each part that is read, with the part's share, 0..1

    For label maps without an image, the voxels show the objects. Raises SourceError if the source
    can't be read.
    """
    shown = _shown(plan)
    channels = [channel for channel in shown.channels if channel.id not in shown.shared_volumes]
    each = max(10_000, VOXELS // len(channels))
    labels = {one.id: one for one in plan.labels if not plan.channels}

    def read(channel: Channel) -> CoarseChannel:
        if channel.id in labels:
            return read_coarse_labels(plan, labels[channel.id], each)
        share_of_one = partial(_pass_on, on_read, len(channels))
        return read_coarse(dataset, plan, channel, each, share_of_one)

    with ThreadPoolExecutor(cores()) as pool:
        found = pool.map(read, channels)
        return {one.voxels_id: coarse for one, coarse in zip(channels, found, strict=True)}


def _pass_on(on_read: OnRead, channels: int, share: float) -> None:
    on_read(share / channels)


def write_first_view(
    plan: Plan, read: Mapping[str, CoarseChannel], root: Path, sizes: Sizes | None = None
) -> None:
    """Write a bundle of a plan's coarse volumes, without a page, into a folder.

    read    see `read_channels`
    sizes   sizes of the finer volumes that the server can send (see `FineTiles.sizes`), or None

    Raises OutputError if a file can't be written.
    """
    with ThreadPoolExecutor(cores()) as pool:
        found = list(
            pool.map(lambda one: first_appearance(plan, one, read[one.voxels_id]), plan.channels)
        )
    shown = _shown(plan)
    made = [appearance for appearance, _ in found] or [
        replace(appearance_of_labels(one), surface_reason=OBJECTS_NOT_BUILT) for one in plan.labels
    ]
    opens = shown.shown_at_first
    appearances = [composed(replace(one, opens=one.id in opens)) for one in made]
    written = write_coarse_tiles(shown, root, read, appearances, sizes or {})
    appearances = [
        as_surface(appearance, read[channel.voxels_id], written.apart)
        for appearance, channel in zip(appearances, shown.channels, strict=True)
    ]
    is_cut = plan.opens_cut and any(is_body for _, is_body in found)
    write_view(shown, root, appearances, written.tiles, is_cut=is_cut)


def _shown(plan: Plan) -> Plan:
    """Return a plan with the channels of its first view: its channels, or else its label maps."""
    if plan.channels:
        return replace(plan, labels=())
    channels = tuple(Channel(one.channel, one.name, one.color) for one in plan.labels)
    return replace(plan, channels=channels, labels=())


def write_view(
    plan: Plan,
    root: Path,
    appearances: Sequence[ComposedAppearance],
    tiles: Sequence[BundleTile],
    *,
    is_cut: bool,
    finished: Collection[str] = (),
) -> None:
    """Write the files of a bundle that all tiles share; the tiles' own files must exist.

    is_cut    whether the specimen opens cut
    finished  IDs of the tiles that have their surfaces
    """
    files: list[FileRef] = [
        ref for tile in tiles for channel in tile.channels for ref in channel.files
    ]
    entries = []
    for i, appearance in enumerate(appearances):
        own = [(tile.id, tile.channels[i]) for tile in tiles]
        entry, written = write_channel(root, appearance, own)
        entries.append(entry)
        files += written
    listed = {ref.path: {"bytes": ref.bytes, "sha256": ref.sha256} for ref in files}
    index = write_file(root, FILES, encode(listed))
    specimen: dict[str, Any] = {
        "name": plan.name,
        "modality": plan.modality,
        "fingerprint": plan.fingerprint,
    }
    if plan.has_sides:
        specimen["sides"] = PATIENT_SIDES
    if is_cut:
        normal, offset_um = opening_plane(np.array([(tile.low, tile.high) for tile in tiles]))
        specimen["cut"] = {"normal": normal, "offset_um": offset_um}
    manifest = describe_bundle(
        specimen,
        tiles,
        channels=entries,
        index=index,
        unfinished={tile.id for tile in tiles} - set(finished),
    )
    write_file(root, MANIFEST, manifest)


def as_surface(
    appearance: ComposedAppearance, coarse: CoarseChannel, apart: float
) -> ComposedAppearance:
    """Return a channel's appearance until its surface is built.

    apart  see `CoarseTiles`

    A finished channel may open with a surface and a translucent volume. Without the surface, the
    image would be much darker than the build's; the volume is therefore drawn like a surface. A
    thin surface in coarse voxels would be full of holes, so coarse voxels are drawn as opaque
    bodies. If the iso-value is relative to a background, no single value marks the surface, and
    coarse voxels stay translucent.
    """
    is_coarse = apart * max(coarse.grid.step) > 1
    like = SHARP if is_coarse else SURFACE
    has_background = appearance.level is not None and appearance.level.background is not None
    if appearance.chosen != SOFT or like not in appearance.transfer_functions:
        return appearance
    return appearance if is_coarse and has_background else replace(appearance, chosen=like)


def composed(appearance: Appearance) -> ComposedAppearance:
    """Return a channel's appearance as the stage of a build states it, without a surface."""
    level, stated = appearance.level, None
    if level is not None:
        stated = StatedLevel(level.iso, level.background_range, level.smoothing_um)
    names = sorted(appearance.transfer_functions, key=lambda name: (name != DEFAULT_FUNCTION, name))
    return ComposedAppearance(
        appearance.id,
        appearance.name,
        appearance.color,
        appearance.window,
        appearance.window,
        appearance.iso_value,
        "none",
        appearance.function,
        {name: appearance.transfer_functions[name] for name in names},
        appearance.transfer_2d,
        appearance.threshold,
        appearance.surface_reason if level is None else NOT_BUILT,
        stated,
        appearance.opens,
    )
