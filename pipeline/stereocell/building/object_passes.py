"""The passes over label maps: first where the objects are, then the units that build them."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, replace
from functools import cache, partial
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter

from stereocell.building.channels import Channel
from stereocell.building.label_maps import Labels
from stereocell.building.label_numbers import notes_on_numbers
from stereocell.building.located_objects import (
    AROUND,
    CUT,
    Located,
    TileGrid,
    locate,
    tile_boxes,
)
from stereocell.building.out_folder import OutFolder
from stereocell.building.plan import Plan
from stereocell.building.plan_source import source_of
from stereocell.building.source_tasks import box_to_json, run_on_input
from stereocell.building.steps import build_objects as objects_maker
from stereocell.building.steps import find_extents as extents_maker
from stereocell.building.steps.build_objects import ImageRef, ObjectsTask, Painted
from stereocell.building.steps.find_extents import (
    ExtentsTask,
    extents_from_json,
    find_in_tile,
    write_extents,
)
from stereocell.building.survey_file import Survey
from stereocell.engine.run import Engine, console
from stereocell.formats.gltf import choose_step
from stereocell.model.counted import counted
from stereocell.model.object_notes import ObjectNotes
from stereocell.objects.options import ObjectOptions
from stereocell.read.readers import reader_of
from stereocell.storage.cache_key import key_of
from stereocell.storage.json_files import find_sealed, read_sealed, write_sealed
from stereocell.storage.location import Location

NOTES = "units.schema.json#Notes"
EXTENTS = "units.schema.json#Extents"
_AGAIN = "run `stereocell units OUT` again"
_UM = 1e6  # um a metre
_COUNTED_AT_ONCE = 1 << 25  # voxels of a label map that `plan` counts: half a second


def locate_objects(out_folder: OutFolder, plan: Plan, labels: Labels, engine: Engine) -> Located:
    """Return which tile builds which object of a label map; a tile that was searched stays so.

    Raises SourceError where a label map can't be read.
    """
    boxes = tile_boxes(TileGrid.of(plan, labels))
    files, tasks = {}, []
    for tile, box in boxes.items():
        depends = [*_key_of(labels), box_to_json(box)]
        key = key_of(depends, extents_maker, reader_of(labels.ref.source))
        files[tile] = out_folder.tile_result("extents", tile, labels.id, key)
        if find_sealed(files[tile], EXTENTS) is None:
            tasks.append((f"{tile}/{labels.name}", (ExtentsTask(labels, box), files[tile])))
    run = partial(engine.run, "objects", write_extents, tasks)
    run_on_input(out_folder, plan, run, [file for _, (_, file) in tasks])
    parts = {
        tile: extents_from_json(read_sealed(file, EXTENTS, _AGAIN)) for tile, file in files.items()
    }
    return locate(plan, labels, parts, plan.settings.objects.smallest_voxels)


def save_notes(out_folder: OutFolder, plan: Plan, labels: Labels) -> None:
    """Keep what a label map's file says of its objects: the stage is made without that file.

    Raises SourceError.
    """
    file = _notes_file(out_folder, plan, labels)
    if find_sealed(file, NOTES) is not None:
        return
    notes = labels.open().notes
    if _has_free_names(plan, labels):
        # pydicom takes a third of a second to import: every command and worker would wait for it
        from stereocell.read.dicom import read_free_labels

        own = read_free_labels(Location.of(labels.ref.source))
        notes = replace(notes, names=notes.names | own)
    write_sealed(file, {"notes": _notes().dump_python(notes, mode="json")})


def read_notes(out_folder: OutFolder, plan: Plan, labels: Labels) -> ObjectNotes:
    """Return what `save_notes` kept. Raises OutputError."""
    file = _notes_file(out_folder, plan, labels)
    return _notes().validate_python(read_sealed(file, NOTES, _AGAIN)["notes"])


def _notes_file(out_folder: OutFolder, plan: Plan, labels: Labels) -> Path:
    kind = f"{labels.id}-free" if _has_free_names(plan, labels) else labels.id
    return out_folder.notes_file(kind, labels.ref.fingerprint)


def _has_free_names(plan: Plan, labels: Labels) -> bool:
    """Return whether segments are called by what somebody wrote."""
    is_dicom = Location.of(labels.ref.source).format == "dicom"
    return plan.settings.objects.segment_labels and is_dicom


@cache
def _notes() -> TypeAdapter[ObjectNotes]:
    return TypeAdapter(ObjectNotes)


def tell_objects(labels: Labels, located: Located) -> None:
    """Print the number of objects, and the notes on their numbers if `plan` did not count them."""
    notes = notes_on_numbers(labels, located) if _is_large(labels) else ()
    for note in (told_of(labels, located), *notes):
        console.print(f"units: {note}", markup=False, soft_wrap=True)


def told_of(labels: Labels, located: Located) -> str:
    """Return how many objects there are, which are cut, and how many are left out, in words."""
    summary = counted(len(located.owners), "object")
    cut = located.extents.labels[located.owners == CUT]
    if len(cut):
        shown = ", ".join(map(str, cut[:8].tolist())) + ", ..." * (len(cut) > 8)
        summary += f", {len(cut)} of them larger than a tile and half around it, and cut ({shown})"
    if located.small:
        summary += f"; {located.small} of too few voxels are left out (objects.smallest_voxels)"
    return f"{labels.name}: {summary}"


def _is_large(labels: Labels) -> bool:
    """Return whether a label map has too many voxels for `plan` to count its objects."""
    return math.prod(labels.shape) > _COUNTED_AT_ONCE


def told_before(plan: Plan) -> Iterator[str]:
    """Yield of each label map what its units will cut, from its voxels where these are few.

    Raises SourceError where they are no labels.
    """
    for labels in plan.labels:
        boxes = tile_boxes(TileGrid.of(plan, labels))
        if not _is_large(labels):
            parts = {tile: find_in_tile(ExtentsTask(labels, box)) for tile, box in boxes.items()}
            found = locate(plan, labels, parts, plan.settings.objects.smallest_voxels)
            yield told_of(labels, found)
            yield from notes_on_numbers(labels, found)
        elif len(plan.tiles) > 1:
            largest = np.max([box.shape for box in boxes.values()], axis=0) * labels.spacing_um
            z, y, x = ((1 + 2 * AROUND) * largest).tolist()
            yield (
                f"{labels.name}: objects larger than a tile and half around it, {z:.4g} x {y:.4g} "
                f"x {x:.4g} um (z, y, x), will be cut at the tiles' planes: `units` names them"
            )


def object_tasks(
    out_folder: OutFolder, plan: Plan, located: Mapping[str, Located], survey: Survey
) -> Iterator[tuple[str, ObjectsTask, str]]:
    """Yield `<tile>/<labels>`, task and key of the unit of each tile and label map."""
    images = images_of(plan)
    step_um = lattice_step_um(plan, located)
    for labels in plan.labels:
        painted = _painted(plan, labels, survey)
        found = located[labels.id]
        boxes = tile_boxes(found.grid)
        for tile in plan.tiles:
            window = found.window(tile.id)
            numbers = found.owned(tile.id)
            near = np.zeros(0, np.int64) if window is None else found.near(window)
            is_cut = found.owners == CUT
            others = np.setdiff1d(near, numbers)
            names = found.extents.labels
            parts = {
                "whole": names[numbers[~is_cut[numbers]]],
                "cut": names[numbers[is_cut[numbers]]],
                "others": names[others],
                "others_cut": names[others[is_cut[others]]],
            }
            depends = [
                *_key_of(labels),
                [labels.spacing_um, labels.origin_um],
                window and box_to_json(window),
                box_to_json(boxes[tile.id]),
                {name: part.tolist() for name, part in parts.items()},
                [edges.tolist() for edges in found.grid.edges] if is_cut.any() else [],
                step_um,
                [_image_key(image) for image in images],
                painted and [_image_key(painted.image), painted.window, painted.depth_um],
                _options_key(plan.settings.objects),
            ]
            readers = {reader_of(ref.source) for ref in (labels.ref, *(i.ref for i in images))}
            key = key_of(depends, objects_maker, *sorted(readers))
            directory = out_folder.unit_dir(tile.id, labels.id, key)
            task = ObjectsTask(
                labels,
                window,
                boxes[tile.id],
                **parts,
                edges=found.grid.edges,
                step_um=step_um,
                images=images,
                painted=painted,
                options=plan.settings.objects,
                directory=directory,
            )
            yield f"{tile.id}/{labels.id}", task, key


def _key_of(labels: Labels) -> list[object]:
    """Return the source of a label map's voxels as a part of a key."""
    background = [labels.background] if labels.background else []
    return [labels.ref.fingerprint, labels.channel, *background]


def _options_key(options: ObjectOptions) -> dict[str, object]:
    """Return the options that units depend on; the labels' background is in their own key."""
    content = asdict(options) | dict.fromkeys(
        ("table", "table_key", "columns", "color_by", "segment_labels")
    )
    del content["background"]
    return content


def lattice_step_um(plan: Plan, located: Mapping[str, Located]) -> float:
    """Return the step of the lattice that objects' vertices lie on, um.

    It is the bundle's, or a multiple of it: a power of two of metres, of tiles as large as they may
    become. So that what is checked is what is written.
    """
    longest = 0.0
    for tile in plan.tiles:
        spacing = np.asarray(plan.spacing_um)
        low = np.array(plan.position_um(tile.box.start)) - spacing
        high = np.array(plan.position_um(tile.box.stop)) + spacing
        for labels in plan.labels:
            window = located[labels.id].window(tile.id)
            if window is not None:
                low = np.minimum(low, labels.position_um(window.start))
                high = np.maximum(high, labels.position_um(window.stop))
        longest = max(longest, float((high - low).max()))
    return choose_step(longest) * _UM


def images_of(plan: Plan) -> tuple[ImageRef, ...]:
    """Return the image's channels, as they are built."""
    seen, found = set(), []
    for channel in plan.channels:
        if channel.voxels_id in seen:
            continue
        seen.add(channel.voxels_id)
        found.append(_image(plan, channel))
    return tuple(found)


def _image(plan: Plan, channel: Channel) -> ImageRef:
    ref, level = source_of(plan, channel=channel), plan.level_of(channel)
    return ImageRef(ref, channel.index, level, plan.region, plan.spacing_um, plan.origin_um)


def _painted(plan: Plan, labels: Labels, survey: Survey) -> Painted | None:
    """Return what is painted on the objects of a label map; None: nothing."""
    painter = plan.painter(labels)
    if painter is None:
        return None
    window = survey[painter.id].statistics.window
    return Painted(_image(plan, painter), window, float(plan.settings.unwrap.paint_um))


def _image_key(image: ImageRef) -> list[object]:
    place = [image.spacing_um, image.origin_um, box_to_json(image.region)]
    return [image.ref.fingerprint, image.channel, image.level, *place]
