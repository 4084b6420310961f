"""Notes on a plan: gaps in the data, ignored settings, changes since the previous plan."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from stereocell.engine.run import console
from stereocell.isosurface.options import LEVEL_NAMES, LEVELS, NO_SURFACE
from stereocell.model.counted import counted
from stereocell.model.errors import SourceError
from stereocell.model.sample_boxes import sample_boxes
from stereocell.model.spacing import Spacing
from stereocell.model.tiling import Box
from stereocell.planning.channels import ALL, Channel
from stereocell.planning.input_files import first_states, open_watched
from stereocell.planning.plan import Plan
from stereocell.planning.plan_source import source_of
from stereocell.planning.settings import Settings, to_dict
from stereocell.read import Dataset
from stereocell.read.absent_chunks import count_absent
from stereocell.steps.open_source import SourceRef

_MAX_CHANGES = 4  # most changed settings in one line
_BODY_UM = 100.0  # um; voxel spacings of at least this are printed in mm
_SEARCHED = 16_000_000  # most voxels of all channels that are searched for NaN


def notes_on_gaps(dataset: Dataset, plan: Plan) -> list[str]:
    """Return a note on each channel with NaN or infinity, from blocks if there are many voxels.

    Raises SourceError if a channel has no finite value.
    """
    indices = list(dict.fromkeys(channel.index for channel in plan.channels))
    if not indices:
        return []
    boxes = sample_boxes(plan.region, max(1, _SEARCHED // len(indices)))
    found = []
    for index in indices:
        share = dataset.share_of_gaps(index, boxes, plan.level)
        if share == 1.0:
            dataset.darkest(index)
        if share > 0.0:
            found.append(
                f"{dataset.channels[index].name}: {max(share, 1e-4):.2%} of the voxels are NaN or "
                "infinite: read as the smallest finite value"
            )
    return found


def notes_on_absent_chunks(dataset: Dataset, plan: Plan) -> list[str]:
    """Return a note on the chunks that are not stored, for the image and for each label map.

    Raises SourceError if no chunk is stored.
    """
    indices = list(dict.fromkeys(channel.index for channel in plan.channels if not channel.source))
    found = _absent(dataset, source_of(plan), indices, plan.region, plan.level) if indices else []
    for labels in plan.labels:
        own, whole = open_watched(labels.ref), Box((0, 0, 0), labels.shape)
        notes = _absent(own, labels.ref, [labels.channel], whole, 0)
        found += [f"labels {labels.name!r}: {note}" for note in notes]
    return found


def _absent(
    dataset: Dataset, ref: SourceRef, channels: Sequence[int], box: Box, level: int
) -> list[str]:
    states = first_states(ref)
    absent = None if states is None else count_absent(dataset, channels, box, level, states)
    if absent is None or not absent.count:
        return []
    nouns = f"{absent.noun}s"
    if absent.count == absent.total:
        raise SourceError(
            f"{dataset.shown}: resolution level {level}: found none of {absent.total} {nouns}, "
            f"expected the {nouns} that hold voxels: copy the volume again, or choose another "
            "--level"
        )
    share = max(absent.count / absent.total, 1e-4)
    return [
        f"{absent.count} of {absent.total} {nouns} of resolution level {level} ({share:.2%}) are "
        f"not stored: they are read as {absent.fill}, and the format does not state whether they "
        "are empty or missing"
    ]


def summary_of(plan: Plan) -> str:
    """Return one line on a plan: its level, voxels, tiles and channels."""
    shape = " x ".join(str(n) for n in plan.region.shape)
    return (
        f"{plan.name}, resolution level {plan.level} ({plan.level_reason}); {shape} voxels "
        f"(z, y, x) of {words_of_spacing(plan.spacing_um)}, "
        f"{counted(len(plan.tiles), 'tile')} x {counted(len(plan.channels), 'channel')}"
        + "".join(f", objects of {one.name}" for one in plan.labels)
    )


def print_notes(plan: Plan) -> None:
    """Print the notes of a plan, a line each."""
    for note in plan.notes:
        console.print(f"plan: {note}", markup=False, soft_wrap=True)


def words_of_spacing(spacing_um: Spacing) -> str:
    """Return a voxel spacing as text, in um, or in mm if it is at least _BODY_UM.

    >>> words_of_spacing((1.0, 0.5, 0.5))
    '1 x 0.5 x 0.5 um'
    """
    unit_um, unit = (1000.0, "mm") if min(spacing_um) >= _BODY_UM else (1.0, "um")
    return " x ".join(f"{along / unit_um:.4g}" for along in spacing_um) + f" {unit}"


def ignored_notes(settings: Settings, channels: Sequence[Channel]) -> Iterator[str]:
    """Yield a note on each setting that another one overrules."""
    options = settings.isovalue
    for channel in channels:
        keys = (channel.name, str(channel.index), ALL)
        given = next((settings.iso_values[k] for k in keys if k in settings.iso_values), None)
        if channel.level and given is not None and given != settings.iso_values.get(ALL):
            yield f"{channel.name}: --surfaces chooses the iso-value, so {given} is ignored"
        if channel.level and options.criterion != LEVELS:
            yield (
                f"{channel.name}: --surfaces chooses the iso-value, so --iso-criterion "
                f"{options.criterion} is ignored"
            )
        is_number = (
            channel.level not in (*LEVEL_NAMES, NO_SURFACE) if channel.level else given is not None
        )
        if is_number and options.scope == "tile":
            yield (
                f"{channel.name}: the settings state its iso-value, so all tiles have the same "
                "one, and --iso-scope tile is ignored"
            )


def changes_of(there: Plan, plan: Plan) -> str:
    """Return a line on the settings in which two plans of the same input differ; empty: none do.

    there  the plan in OUT, which `plan` replaces
    """
    if replace(there, notes=plan.notes) == plan:
        return ""
    old, new = to_dict(there.settings), to_dict(plan.settings)
    changes = [
        f"{section}.{key}: {old[section].get(key)!r:.40}, now {new[section].get(key)!r:.40}"
        for section in new
        for key in {**old[section], **new[section]}
        if old[section].get(key) != new[section].get(key)
    ]
    names, now = (", ".join(one.name for one in each.channels) for each in (there, plan))
    if names != now:
        changes.insert(0, f"channels: {names:.80}, now {now:.80}")
    more = len(changes) - _MAX_CHANGES
    listed = "; ".join(changes[:_MAX_CHANGES]) + (f"; and {more} more" if more > 0 else "")
    return (
        f"OUT holds a build of this input with other settings, whose results are replaced: "
        f"{listed or 'the input has another path'}"
    )
