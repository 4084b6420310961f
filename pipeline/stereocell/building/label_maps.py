"""The label maps of a build: where each is, and how it lies on the image."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stereocell.building.input_files import open_anew
from stereocell.building.open_source import SourceRef, as_asked, open_source
from stereocell.building.settings import PlanOptions
from stereocell.model.errors import SourceError, UsageError
from stereocell.model.identifiers import to_identifier
from stereocell.model.rigid_transform import IDENTITY
from stereocell.read.dataset import Dataset
from stereocell.read.label_map import LabelMap
from stereocell.storage.location import Location

SELF = "."  # in place of a path: the input itself
_MAX_ROUNDING = 1e-6  # largest difference of two rotations' elements: rounding
_COLOURS = "colour pixels"  # how a reader's remark on them begins
_AVERAGED = ("resampled", "interpolated")  # in what a reader says of voxels between others

Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Labels:
    """A label map of a build, a channel beside the image's. Its finest level is what is built.

    ref         how it is opened, with the fingerprint that it had
    channel     index in the source
    spacing_um  (z, y, x), um
    origin_um   (z, y, x), um: centre of its voxel (0, 0, 0), from that of the image's
    shape       voxels (z, y, x)
    color       linear RGB 0..1, of objects without one of their own
    """

    name: str
    ref: SourceRef
    channel: int
    spacing_um: Triple
    origin_um: Triple
    shape: tuple[int, int, int]
    color: Triple

    @property
    def id(self) -> str:
        """The name as an identifier, for paths and prims."""
        return to_identifier(self.name)

    def open(self) -> LabelMap:
        """Return the label map. Raises SourceError."""
        return LabelMap(open_source(self.ref), self.channel)

    def position_um(self, index_zyx: Sequence[float]) -> Triple:
        """Return the place of a voxel's centre, (z, y, x) in um, as a plan's `position_um`."""
        places = zip(self.origin_um, index_zyx, self.spacing_um, strict=True)
        z, y, x = (float(o + i * s) for o, i, s in places)
        return z, y, x


def are_alone(wanted: Mapping[str, str]) -> bool:
    """Return whether the input itself is a label map, so that there is no image."""
    return any(SELF in pair for pair in wanted.items())


def find_labels(
    image: Dataset,
    source: str,
    wanted: Mapping[str, str],
    *,
    options: PlanOptions,
    colors: Sequence[Triple],
    taken: Sequence[str],
) -> tuple[Labels, ...]:
    """Return the label maps that are asked for, by name, in the order given.

    image   the input, which may be a label map itself
    wanted  path by name: empty means one of the input's own `labels`, SELF the input
    colors  by turns
    taken   names of the image's channels

    Raises UsageError, SourceError.
    """
    found: list[Labels] = []
    # but for their case: on Windows and macOS their files would be one
    ids = [to_identifier(name).lower() for name in taken]
    for name, place in wanted.items():
        if not name.isprintable():
            raise UsageError(f"--labels {name!r:.60}: expected a name without control characters")
        dataset, ref = _opened(image, source, name, place, options)
        title = name
        if name == SELF:  # the name of a patient's file may be the patient's
            title = "labels" if image.has_sides else image.name
        several = len(dataset.channels) > 1  # segments that overlap come as several
        for index, channel in enumerate(dataset.channels):
            one = Labels(
                f"{title} {channel.name}" if several else title,
                ref,
                index,
                dataset.levels[0].spacing_um,
                _origin(image, dataset),
                dataset.levels[0].shape,
                colors[len(found) % len(colors)],
            )
            if one.id.lower() in ids:
                raise UsageError(
                    f"--labels {one.name}: a channel has that name (small letters or capitals), "
                    f"expected another one, as {one.name}_objects=PATH"
                )
            _require_overlap(image, one, dataset.shown)
            ids.append(one.id.lower())
            found.append(one)
    return tuple(found)


def _opened(
    image: Dataset, source: str, name: str, place: str, options: PlanOptions
) -> tuple[Dataset, SourceRef]:
    """Return a label map's dataset, and how it was opened."""
    if SELF in (name, place):
        return _as_stored(image), as_asked(source, options, fingerprint=image.fingerprint)
    where = Location.of(place or f"{source.rstrip('/')}/labels/{name}").source
    ref = SourceRef(where, 0, ())
    try:
        dataset = open_anew(ref)
    except SourceError as error:
        if "voxel size" not in str(error):
            remedy = "" if place else f"; or give its path, as --labels {name}=PATH"
            raise SourceError(f"--labels {name}: {error}{remedy}") from error
        # masks of segmentation programs state no lengths: they lie on the image
        ref = replace(ref, spacing_um=image.levels[0].spacing_um)
        dataset = open_anew(ref)
        if dataset.levels[0].shape != image.levels[0].shape:
            raise SourceError(
                f"{dataset.shown}: states no voxel size: found {_by(dataset.levels[0].shape)} "
                f"voxels (z, y, x), expected the image's {_by(image.levels[0].shape)}"
            ) from error
    return _as_stored(dataset), replace(ref, fingerprint=dataset.fingerprint)


def _as_stored(dataset: Dataset) -> Dataset:
    """Return a dataset whose voxels are the file's own. Raises SourceError for any other."""
    for remark in dataset.remarks:
        if remark.startswith(_COLOURS):
            raise SourceError(
                f"{dataset.shown}: found colour pixels, expected labels: one number a voxel"
            )
        if any(word in remark for word in _AVERAGED):
            raise SourceError(
                f"{dataset.shown}: {remark}: found numbers of objects, which have no means, "
                "expected labels on a grid that needs none"
            )
    return dataset


def _origin(image: Dataset, labels: Dataset) -> Triple:
    """Return the centre of the labels' first voxel, from the image's (z, y, x), um.

    Raises SourceError where they are turned to the image, or which way round they lie is not known.
    """
    if _ways_round(image) != _ways_round(labels):
        raise SourceError(
            f"{labels.shown}: found {_ways_round(labels)}, and the image has "
            f"{_ways_round(image)}: which way round the labels lie on it is not known, expected "
            "both in formats that say it alike, as both NIfTI or both TIFF"
        )
    if image.has_sides or image.placement != IDENTITY:
        between = np.linalg.inv(np.array(image.placement)) @ np.array(labels.placement)
        if np.abs(between[:3, :3] - np.eye(3)).max() > _MAX_ROUNDING:
            raise SourceError(
                f"{labels.shown}: lies turned to the image, expected labels along its axes"
            )
        x, y, z = (float(part) for part in between[:3, 3])
        return z, -y, x
    if labels.levels[0].shape == image.levels[0].shape and not any(labels.offset_um):
        return 0.0, 0.0, 0.0  # on the same voxels; who wrote no place did not mean another one
    places = zip(labels.offset_um, image.offset_um, strict=True)
    z, y, x = (own - first for own, first in places)
    return z, y, x


def _ways_round(dataset: Dataset) -> str:
    """Return by what a reader laid a dataset's axes, for messages."""
    if dataset.has_sides:
        return "axes by a patient's sides"
    return "its file's own axes" if dataset.placement == IDENTITY else "axes by guessed sides"


def _require_overlap(image: Dataset, labels: Labels, shown: str) -> None:
    """Raise SourceError where labels lie beside the image: one of them states a wrong place."""
    finest = image.levels[0]
    ends = labels.position_um([n - 1 for n in labels.shape])
    lasts = [(n - 1) * s for n, s in zip(finest.shape, finest.spacing_um, strict=True)]
    pairs = zip(labels.origin_um, ends, lasts, strict=True)
    if not all(low <= last and high >= 0 for low, high, last in pairs):
        first = ", ".join(f"{part:g}" for part in labels.origin_um)
        raise SourceError(
            f"{shown}: lies beside the image: found its first voxel at {first} um (z, y, x) from "
            "the image's, expected labels of that image"
        )


def _by(numbers: Sequence[int]) -> str:
    return " x ".join(map(str, numbers))
