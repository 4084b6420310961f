"""Find the label maps of a build, and lay each on the image."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from stereocell.model.errors import SourceError, UsageError
from stereocell.model.identifiers import to_identifier
from stereocell.planning.input_files import as_asked, reopen
from stereocell.planning.label_grids import (
    has_other_spacing,
    note_on_assumed,
    note_on_cover,
    origin_on,
    require_overlap,
    settle_spacing,
)
from stereocell.planning.settings import PlanOptions, Settings
from stereocell.read.addresses.resolve import resolve
from stereocell.read.dataset import Dataset
from stereocell.read.remarks import CAST
from stereocell.steps.labels import Labels, Triple
from stereocell.steps.open_source import SourceRef

SELF = "."  # stands in place of a path for the input itself
_SHOWN = 4  # most names in a note
_COLOURS = "colour pixels"  # first words of a reader's remark on colour images
_AVERAGED = ("resampled", "interpolated")  # words in a reader's remark on averaged voxels


@dataclass(frozen=True, slots=True)
class FoundLabels:
    """The label maps of a build, and notes on what was chosen or assumed about their grids."""

    labels: tuple[Labels, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Opened:
    """A label map's dataset, how it was opened, and where its first voxel lies on the image.

    origin_um  centre of its first voxel from that of the image's, (z, y, x) in um
    notes      sentences without the label map's name
    """

    dataset: Dataset
    ref: SourceRef
    origin_um: Triple
    notes: tuple[str, ...] = ()


def are_alone(wanted: Mapping[str, str]) -> bool:
    """Return whether the input itself is a label map, so that the build has no image."""
    return any(SELF in pair for pair in wanted.items())


def find_labels(
    image: Dataset,
    source: str,
    wanted: Mapping[str, str],
    *,
    settings: Settings,
    colors: Sequence[Triple],
    taken: Sequence[str],
) -> FoundLabels:
    """Return the requested label maps, in the order given.

    image   the input, which may be a label map itself
    wanted  path by name; an empty path means one of the input's own `labels`, SELF the input
    colors  linear RGB, given to the label maps in turn
    taken   names of the image's channels

    Raises UsageError for a name that can't be used, SourceError for a map that does not fit.
    """
    found: list[Labels] = []
    notes: list[str] = []
    # compared in small letters, because Windows and macOS ignore case in file names
    ids = [to_identifier(name).lower() for name in taken]
    for name, place in wanted.items():
        if not name.isprintable():
            raise UsageError(
                f"--labels is {name!r:.60}, expected a name without control characters"
            )
        opened = _opened(image, source, name, place, settings.plan)
        title = name
        if name == SELF:  # a patient's file is not named, since its name may be the patient's
            title = "labels" if image.has_sides else image.name
        channels = opened.dataset.channels
        several = len(channels) > 1  # readers return overlapping segments as several channels
        own_notes = [*opened.notes, *_on_channels([one.name for one in channels])]
        for index, channel in enumerate(channels):
            one = Labels(
                f"{title} {channel.name}" if several else title,
                opened.ref,
                index,
                opened.dataset.levels[0].spacing_um,
                opened.origin_um,
                opened.dataset.levels[0].shape,
                colors[len(found) % len(colors)],
                settings.objects.background,
            )
            if one.id.lower() in ids:
                raise UsageError(
                    f"--labels {one.name}: a channel has this name already (case is ignored), "
                    f"expected another name, such as {one.name}_objects=PATH"
                )
            ids.append(one.id.lower())
            found.append(one)
        if SELF not in (name, place):
            require_overlap(image, opened.dataset, opened.origin_um)
            cover = note_on_cover(image, opened.dataset, opened.origin_um)
            own_notes += [cover] if cover else []
        notes += [f"labels {title!r}: {note}" for note in own_notes]
    return FoundLabels(tuple(found), tuple(notes))


def _opened(image: Dataset, source: str, name: str, place: str, options: PlanOptions) -> _Opened:
    """Return a label map's dataset, how it was opened, and its place on the image."""
    if SELF in (name, place):
        ref = as_asked(source, options, fingerprint=image.fingerprint)
        return _Opened(_as_stored(image), ref, (0.0, 0.0, 0.0))
    resolved = resolve(place or f"{source.rstrip('/')}/labels/{name}")
    ref = SourceRef(resolved.source, 0, ())
    try:
        dataset = reopen(ref)
    except SourceError as error:
        if "voxel size" not in str(error):
            remedy = "" if place else f"; or give its path by --labels {name}=PATH"
            raise SourceError(f"--labels {name}: {error}{remedy}") from error
        return _without_size(image, ref, options, error)
    dataset, ref, note = _at_time(image, _as_stored(dataset), ref, options)
    notes = [*resolved.notes, *([note] if note else [])]
    origin = origin_on(image, dataset)
    if has_other_spacing(image, dataset):
        notes += settle_spacing(image, dataset)
        ref = replace(ref, spacing_um=image.levels[0].spacing_um)
        dataset = reopen(ref)
    return _finished(dataset, ref, origin, notes)


def _without_size(
    image: Dataset, ref: SourceRef, options: PlanOptions, error: SourceError
) -> _Opened:
    """Return a label map without a voxel size, laid on the image's level of the same shape."""
    ref = replace(ref, spacing_um=image.levels[0].spacing_um)
    dataset = _as_stored(reopen(ref))
    shape = dataset.levels[0].shape
    same = (index for index, level in enumerate(image.levels) if level.shape == shape)
    if (level := next(same, None)) is None:
        is_turned = sorted(shape) == sorted(image.levels[0].shape)
        hint = ": its axes are in another order; save it as (z, y, x)" if is_turned else ""
        raise SourceError(
            f"{dataset.shown}: states no voxel size: found {_by(shape)} voxels (z, y, x), "
            f"expected the image's {_by(image.levels[0].shape)}{hint}"
        ) from error
    if level:
        ref = replace(ref, spacing_um=image.levels[level].spacing_um)
        dataset = reopen(ref)
    dataset, ref, note = _at_time(image, dataset, ref, options)
    notes = [*([note] if note else []), note_on_assumed(image, level)]
    origin = image.levels[level].origin_um if level else origin_on(image, dataset)
    return _finished(dataset, ref, origin, notes)


def _at_time(
    image: Dataset, dataset: Dataset, ref: SourceRef, options: PlanOptions
) -> tuple[Dataset, SourceRef, str]:
    """Return a label map at the image's point in time, and a note if it has only one point."""
    if dataset.time_points == 1:
        if image.time_points == 1:
            return dataset, ref, ""
        note = (
            f"has one point in time, which is used for --time {options.time} of {image.time_points}"
        )
        return dataset, ref, note
    if options.time >= dataset.time_points:
        raise SourceError(
            f"{dataset.shown}: found {dataset.time_points} points in time, expected the image's "
            f"--time {options.time} among them"
        )
    if options.time:
        ref = replace(ref, time=options.time)
        dataset = reopen(ref)
    return dataset, ref, ""


def _finished(dataset: Dataset, ref: SourceRef, origin_um: Triple, notes: Sequence[str]) -> _Opened:
    """Return an opened label map with the notes of its reader."""
    # labels are read without a cast, so a note on one does not apply
    own = [note for note in dataset.notes if not note.startswith(CAST)]
    ref = replace(ref, fingerprint=dataset.fingerprint)
    return _Opened(dataset, ref, origin_um, (*own, *notes))


def _on_channels(names: Sequence[str]) -> list[str]:
    """Return the note on a label map of several channels."""
    if len(names) < 2:
        return []
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return [f"{len(names)} channels, each a label map: {', '.join(names[:_SHOWN])}{more}"]


def _as_stored(dataset: Dataset) -> Dataset:
    """Return the dataset. Raises SourceError if its voxels are not as the file stores them."""
    for remark in dataset.remarks:
        if remark.startswith(_COLOURS):
            raise SourceError(
                f"{dataset.shown}: found colour pixels, expected labels: one number a voxel"
            )
        if any(word in remark for word in _AVERAGED):
            raise SourceError(
                f"{dataset.shown}: {remark}: found averaged numbers of objects, which mean "
                "nothing, expected labels on a grid that needs no averaging"
            )
    return dataset


def _by(numbers: Sequence[int]) -> str:
    return " x ".join(map(str, numbers))
