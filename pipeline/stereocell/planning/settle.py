"""Make the plan of a build from its source and settings, without writing or printing anything."""

from collections.abc import Sequence
from dataclasses import replace

from stereocell.meshes.alpha_wrap import find_wrapper
from stereocell.model.errors import UsageError
from stereocell.model.tiling import Box
from stereocell.planning.channel_colors import choose_colors, is_lone, lies_at_bone, shows_stain
from stereocell.planning.channels import PALETTE, Channel, with_surfaces
from stereocell.planning.hounsfield import assert_hounsfield, settle_modality
from stereocell.planning.input_files import as_asked, reopen, watch_table
from stereocell.planning.intensities import note_on_intensities, require_intensities
from stereocell.planning.label_maps import are_alone, find_labels
from stereocell.planning.label_numbers import notes_before_units
from stereocell.planning.object_tables import (
    require_color_by,
    table_of,
)
from stereocell.planning.plan import Plan, choose_level, make_plan, parse_region
from stereocell.planning.plan_notes import (
    ignored_notes,
    notes_on_absent_chunks,
    notes_on_gaps,
)
from stereocell.planning.settings import INTENSITY, Settings
from stereocell.read.addresses.resolve import resolve
from stereocell.read.image import printable
from stereocell.read.known_formats import format_of
from stereocell.read.remarks import CAST
from stereocell.textures.map_packages import (
    require_map_packages,
)


def settle(source: str, settings: Settings, choice: Sequence[str] = (), *, title: str = "") -> Plan:
    """Return the plan of a build, with its notes, without writing or printing anything.

    choice  notes on how the preset was chosen; see `load_for`
    title   name of the specimen; empty: the source's name for it

    Raises StereoCellError if the source can't be read, or the settings don't fit it.
    """
    resolved = resolve(source)
    location = resolved.source
    options = settings.plan
    if settings.surface.wrap == "alpha-wrap":
        find_wrapper()
    if settings.unwrap.maps:
        require_map_packages()
    _require_labels(settings)
    dataset = assert_hounsfield(reopen(as_asked(location, options)), options.taken_as)
    alone = are_alone(settings.labels)
    settings, modality = settle_modality(dataset, settings, are_labels=alone)
    indices = dataset.find_channels(options.channels) if options.channels else None
    chosen = range(0 if alone else len(dataset.channels)) if indices is None else indices
    wanted = [dataset.channels[index] for index in chosen]
    colors = choose_colors(
        [(one.name, one.color) for one in wanted],
        modality=modality.code,
        is_alone=is_lone([one.name for one in dataset.channels]),
        is_bone=lies_at_bone(settings.iso_values, is_hounsfield=modality.is_hounsfield),
        is_stained=shows_stain(dataset.levels[0].spacing_um, is_dark=options.dark),
    )
    channels = [
        Channel(index, one.name, color)
        for index, one, color in zip(chosen, wanted, colors, strict=True)
    ]
    channels = with_surfaces(channels, settings.surfaces)
    level = choose_level(dataset.levels, len(channels), settings)
    found = find_labels(
        dataset,
        location,
        settings.labels,
        settings=settings,
        colors=PALETTE[len(channels) :] + PALETTE[: len(channels)],
        taken=[channel.name for channel in channels],
    )
    if options.taken_as != INTENSITY and channels:
        whole = Box((0, 0, 0), dataset.levels[level[0]].shape)
        require_intensities(dataset, chosen, parse_region(options.region, whole), level[0])
    origin = dataset.levels[level[0]].origin_um
    plan = make_plan(
        location,
        printable(title) or dataset.name,
        fingerprint=dataset.fingerprint,
        levels=dataset.levels,
        origin_um=origin,
        channels=channels,
        level=level,
        settings=settings,
        modality=modality.code,
        placement=dataset.placement,
        slice_axis=dataset.slice_axis(level[0]),
        has_sides=dataset.has_sides,
        labels=found.labels,
        formats={
            format_of(one).name
            for one in (location, *(labels.ref.source for labels in found.labels))
        },
    )
    if settings.objects.table:
        watch_table(settings.objects.table)
    objects = list(found.notes)
    for one in plan.labels:
        # an unreadable table or a missing column should end the command before the build
        table = table_of(plan, one)
        require_color_by(plan, one, table)
        objects += [f"table: {note}" for note in table.notes] if table else []
    gaps = notes_on_absent_chunks(dataset, plan) + notes_on_gaps(dataset, plan)
    objects += notes_before_units(plan)
    objects += filter(None, map(note_on_intensities, plan.labels))
    if settings.objects.table and len(plan.labels) > 1:
        objects.append(f"the table is joined only to the first label map, {plan.labels[0].name}")
    # labels are read without a cast, so a note on one does not apply
    read = (note for note in dataset.notes if not (alone and note.startswith(CAST)))
    kind = [modality.note] if modality.note else []
    notes = (
        *resolved.notes,
        *read,
        *choice,
        *kind,
        *gaps,
        *objects,
        *ignored_notes(settings, channels),
    )
    return replace(plan, notes=notes, is_hounsfield=modality.is_hounsfield)


def _require_labels(settings: Settings) -> None:
    """Raise UsageError if settings of objects or of a table are given without either."""
    options = settings.objects
    for flag, value in {
        "--table": options.table,
        "--table-key": options.table_key,
        "--columns": ",".join(options.columns),
        "--color-by": options.color_by,
        "--background": str(options.background or ""),
    }.items():
        if value and not settings.labels:
            raise UsageError(
                f"{flag} is {value!r:.60}, expected --labels with it, because it is about the "
                "objects of a label map"
            )
        if value and not options.table and flag in ("--table-key", "--columns"):
            raise UsageError(
                f"{flag} is {value!r:.60}, expected --table with it, because it is about the "
                "columns of a table"
            )
