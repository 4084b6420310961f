"""Read DICOM: a folder at any depth, or one file, single-frame or enhanced multi-frame.

header.py lists the attributes that are read, series.py sorts frames into volumes, and
read/plane_stack.py lays out the planes. Files are found by content, not by name.

References: DICOM PS3.3 (information object definitions).
"""

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pydicom
from numpy.typing import NDArray

from stereocell.model.counted import agreeing, counted
from stereocell.model.errors import SourceError, UsageError
from stereocell.read.acquired import Acquired, turned_places
from stereocell.read.anatomical_axes import Canonical, canonical_of
from stereocell.read.beside import or_one_of
from stereocell.read.dataset import VoxelArray
from stereocell.read.formats.dicom.frame import Frame
from stereocell.read.formats.dicom.header import SEGMENTATION, is_dicom, read_frames
from stereocell.read.formats.dicom.known_headers import KnownHeaders
from stereocell.read.formats.dicom.label_stack import stack_labels
from stereocell.read.formats.dicom.lesser_kind import lesser_notes
from stereocell.read.formats.dicom.no_plane import NoPlaneError
from stereocell.read.formats.dicom.pixels import decode, dtype_of
from stereocell.read.formats.dicom.remedies import in_words
from stereocell.read.formats.dicom.segmentation import LABELMAP, free_labels
from stereocell.read.formats.dicom.series import find_stacks, is_other_kind
from stereocell.read.formats.dicom.silence_logs import DICOM_FAULTS, quiet
from stereocell.read.formats.dicom.stack import Stack
from stereocell.read.formats.dicom.twice_rescaled import describe_values
from stereocell.read.image import Image
from stereocell.read.known_formats import identify
from stereocell.read.plane_stack import NoStackError, StackLayout
from stereocell.read.resample import resample_stack
from stereocell.read.series import numbers_of
from stereocell.read.spacing import Grid
from stereocell.read.statements import omission
from stereocell.read.whole_array import WholeArray
from stereocell.storage.location import Location, first_bytes, is_own

_INSTEAD = "expected the image that it was drawn on"
_MOST_KINDS = 4  # kinds of images that a note names at most
_COPIES = "copies of others"
UNKNOWN = "DICOM"  # name of a dataset of unknown modality


@dataclass(frozen=True, slots=True)
class Found:
    """The DICOM files of a folder in the order of names, their stacks, and counts of other files.

    frames    frames of all stacks
    left_out  reason -> number of files without a usable plane
    """

    paths: tuple[Path, ...]
    frames: tuple[Frame, ...]
    stacks: tuple[Stack, ...]
    left_out: Counter[str]


def read_image(location: Location, *, series: int = 0) -> Image:
    """Return one series; 0 is the largest, others count from 1 as `list_series` does.

    If there are only segmentations, 0 is the label map of all segments. Raises SourceError where
    the series is not a volume, UsageError where the source lacks the series.
    """
    found = _find(location)
    if series > len(found.stacks):
        raise UsageError(
            f"{location.shown}: --series: found {series}, expected {numbers_of(len(found.stacks))} "
            "(`--series list` shows them)"
        )
    stack = found.stacks[max(series, 1) - 1]
    if (segmentation := stack.first.segmentation) is not None:
        # A LABELMAP's pixels are object numbers, which can't be averaged like one segment's mask.
        if not series or segmentation.kind == LABELMAP:
            return _label_map(found, stack, series, location.shown)
        if stack.layout is None:
            raise _no_labels(stack, len(found.stacks), location.shown, stack.problem)
    if stack.layout is None:
        raise SourceError(
            f"{location.shown}: {stack.problem}, expected parallel slices of one volume "
            "(`--series list` shows what is there)"
        )
    _require_parts(stack, location.shown)
    layout, dtype = stack.layout, dtype_of([f for frames in stack.times for f in frames])
    canonical = canonical_of(layout.affine, layout.shape)
    z, y, x = (layout.shape[axis] for axis in canonical.order)
    load = partial(_load, stack, canonical, found.paths, dtype, location.shown)
    voxels = WholeArray((len(stack.times), z, y, x), dtype, load)
    read = {frame.file for frames in stack.times for frame in frames}
    modality = stack.first.modality
    is_hounsfield, values = describe_values(
        stack, lambda frames: decode(frames, found.paths, dtype, location.shown)
    )
    return Image(
        arrays=(VoxelArray(voxels, ("t", "z", "y", "x")),),
        grids=(Grid((z, y, x), canonical.spacing_um),),
        names=(modality or UNKNOWN,),
        colors=(None,),
        images=1,
        title=modality or UNKNOWN,
        modality=modality,
        has_hounsfield_units=is_hounsfield,
        placement=canonical.placement,
        # the axes of an animal are left, dorsal and cranial
        has_sides=not stack.first.is_quadruped,
        labels=_labels(stack, len(found.stacks)),
        acquired=_acquired(stack, layout, canonical, found.paths, dtype, location.shown),
        notes=(
            *_choice(found, stack, series),
            *stack.elsewhere,
            *lesser_notes(stack, found.stacks),
            *stack.notes,
            *values,
            *_left_out(found.left_out),
        ),
        files=tuple(str(found.paths[index]) for index in sorted(read)),
    )


def _require_parts(stack: Stack, shown: str) -> None:
    """Raise SourceError where files of an image that is stored in several files are missing."""
    held: dict[tuple[bytes, int], set[int]] = {}
    for frame in (frame for frames in stack.times for frame in frames):
        held.setdefault(frame.parts, set()).add(frame.file)
    for (_, parts), files in held.items():
        if len(files) < parts:
            raise SourceError(
                f"{shown}: found {len(files)} of {parts} files of an image that is stored in "
                f"several (a concatenation), expected all of them: copy the folder again"
            )


def _label_map(found: Found, stack: Stack, series: int, shown: str) -> Image:
    """Return a segmentation as object numbers: one channel, or one per segment if they overlap.

    Raises SourceError and UsageError.
    """
    own = stack.first.segmentation
    files = {frame.file for frame in found.frames if frame.segmentation is not None}
    if len(files) > 1 and not series:
        raise UsageError(f"{shown}: found {len(files)} segmentations, expected one: name its file")
    try:
        assert own is not None
        labels = stack_labels(own, [f for f in found.frames if f.file == stack.first.file])
    except NoStackError as error:
        raise _no_labels(stack, len(found.stacks), shown, str(error)) from None
    overlap = labels.do_overlap(found.paths, shown)
    channels = [[number] for number in labels.numbers] if overlap else [labels.numbers]
    canonical = canonical_of(labels.affine, labels.shape)
    z, y, x = (labels.shape[axis] for axis in canonical.order)

    def load(channel: int) -> NDArray[Any]:
        return canonical.apply(labels.load(found.paths, shown, channels[channel]))

    voxels = WholeArray((len(channels), z, y, x), labels.dtype, load)
    title = stack.first.modality or UNKNOWN
    return Image(
        arrays=(VoxelArray(voxels, ("c", "z", "y", "x")),),
        grids=(Grid((z, y, x), canonical.spacing_um),),
        names=tuple(f"segment {number}" for (number,) in channels) if overlap else (title,),
        colors=(None,) * len(channels),
        images=1,
        title=title,
        modality=stack.first.modality,
        placement=canonical.placement,
        has_sides=not stack.first.is_quadruped,
        labels=_labels(stack, len(found.stacks)),
        objects=own.objects,
        acquired=Acquired(canonical.order.index(0)),
        notes=_left_out(found.left_out),
        files=(str(found.paths[stack.first.file]),),
    )


def _no_labels(stack: Stack, stacks: int, shown: str, problem: str) -> UsageError:
    return UsageError(
        f"{shown}: this is a label map: found {_labels(stack, stacks)}, {problem}, {_INSTEAD}, or "
        "a mask by --series N --as intensity"
    )


def read_free_labels(location: Location) -> dict[int, str]:
    """Return the labels of a segmentation's segments, by number; empty: it has none.

    Labels are free text and may identify the patient. Raises SourceError and UsageError.
    """
    found = _find(location)
    first = found.stacks[0].first
    if first.segmentation is None:
        return {}
    try:
        with quiet():
            path = found.paths[first.file]
            header = pydicom.dcmread(
                path, stop_before_pixels=True, force=True, specific_tags=["SegmentSequence"]
            )
            return free_labels(header)
    except DICOM_FAULTS:
        raise SourceError(
            f"{location.shown}: segments: found labels that can't be read, expected a complete "
            "segmentation"
        ) from None


def list_series(location: Location) -> tuple[str, ...]:
    """Return a line for each series, numbered as for `--series`. Raises SourceError."""
    found = _find(location)
    lines = [f"{i:3d}  {stack.label}" for i, stack in enumerate(found.stacks, start=1)]
    for i, stack in enumerate(found.stacks):
        lines[i] += "".join(f"; {note}" for note in stack.notes)
    return tuple(lines)


def _find(location: Location) -> Found:
    root = Path(location.source)
    files = _files(root) if root.is_dir() else [root]
    _require_own(location, files)
    paths = [path for path in files if is_dicom(path)]
    left_out: Counter[str] = Counter()
    if len(paths) < len(files):
        left_out["not DICOM"] = len(files) - len(paths)
    frames: dict[bytes, Frame] = {}
    copies: list[tuple[Frame, Frame]] = []
    remedies: list[str] = []
    known = KnownHeaders()
    for index, path in enumerate(paths):
        try:
            for frame in read_frames(path, index, known):
                key = frame.instance + frame.index.to_bytes(4) + frame.tile.to_bytes(4)
                earlier = frames.setdefault(key, frame)
                if earlier is not frame:
                    copies.append((earlier, frame))
        except NoPlaneError as error:
            left_out[str(error)] += 1
            remedies.append(error.remedy)
    compare = partial(_are_equal, paths, location.shown)
    twice = set()
    # Images with one UID are copies if their positions and pixels are equal, else separate images.
    for earlier, frame in copies:
        if earlier.position == frame.position and compare(earlier, frame):
            twice.add(frame.file)
        else:
            frames[f"{frame.file} {frame.index} {frame.tile}".encode()] = frame
    if twice:
        left_out[_COPIES] = len(twice)
    if not frames:
        other = next((path for path in files if not is_dicom(path)), None)
        if other is not None and (what := identify(first_bytes(str(other)))).is_known:
            first = f"the first is {what.words}" if left_out["not DICOM"] > 1 else what.words
            left_out[f"not DICOM ({first})"] = left_out.pop("not DICOM")
        held = "; ".join(f"{count} {reason}" for reason, count in sorted(left_out.items()))
        if not root.is_dir():
            held = f"one file, {next(iter(left_out), 'which is not DICOM')}"
        if left_out and all(reason.startswith(SEGMENTATION) for reason in left_out):
            raise UsageError(f"{location.shown}: this is a label map: found {held}, {_INSTEAD}")
        many = f"{len(files)} file{'s' * (len(files) != 1)}: " if files and root.is_dir() else ""
        raise SourceError(
            f"{location.shown}: no DICOM image with a place in the patient: found "
            f"{many}{held or 'an empty folder'}, expected slices of MR, CT or the like"
            f"{'' if paths else ', or a volume of another format'}"
            f"{or_one_of(root, 'dicom')}{in_words(remedies)}"
        )
    every = tuple(frames.values())
    return Found(tuple(paths), every, find_stacks(every, compare), left_out)


def _files(folder: Path) -> list[Path]:
    """Return all files below a folder, sorted, so that the order doesn't depend on the disk."""
    found = [Path(at) / name for at, _, names in os.walk(folder) for name in names]
    return sorted(found, key=lambda path: path.relative_to(folder).parts)


def _require_own(location: Location, files: Sequence[Path]) -> None:
    """Raise SourceError for a link that leads out of the folder. Its number stands for its name.

    Pipes, devices and broken links are skipped, because the reader doesn't open them.
    """
    own = [location.folder]
    for number, path in enumerate(files, start=1):
        if path.is_file() and not is_own(path, own):
            raise SourceError(
                f"{location.shown}: file {number} of {len(files)} in the order of names: found a "
                "link that leads out of the folder, expected files inside it "
                "(`cp -rL` copies what links lead to)"
            )


def _are_equal(paths: Sequence[Path], shown: str, a: Frame, b: Frame) -> bool:
    if (a.rows, a.columns) != (b.rows, b.columns):
        return False
    ours, theirs = (decode([f], paths, dtype_of([a, b]), shown) for f in (a, b))
    return bool(np.array_equal(ours, theirs))


def _load(
    stack: Stack,
    canonical: Canonical,
    paths: Sequence[Path],
    dtype: np.dtype[Any],
    shown: str,
    time: int,
) -> NDArray[Any]:
    planes = decode(stack.times[time], paths, dtype, shown)
    if stack.layout is not None and stack.layout.is_resampled:
        planes = resample_stack(planes, stack.layout)
    return canonical.apply(planes)


def _labels(stack: Stack, stacks: int) -> str:
    segmentation = stack.first.segmentation
    if segmentation is None:
        return ""
    each = " (each a series of --series list)" * (stack.first.segment > 0 and stacks > 1)
    return f"a DICOM segmentation of {segmentation.words}{each}"


def _acquired(
    stack: Stack,
    layout: StackLayout,
    canonical: Canonical,
    paths: Sequence[Path],
    dtype: np.dtype[Any],
    shown: str,
) -> Acquired:
    axis = canonical.order.index(0)
    if not layout.is_resampled:
        return Acquired(axis)
    plane_shape = stack.first.rows, stack.first.columns
    first = turned_places(layout.places, plane_shape, layout.shape, canonical)
    return Acquired(
        axis, first, lambda time: canonical.apply(decode(stack.times[time], paths, dtype, shown))
    )


def _choice(found: Found, stack: Stack, series: int) -> tuple[str, ...]:
    """Return which of several stacks is built, and other kinds of image in the same series."""
    if len(found.stacks) == 1:
        return ()
    number = found.stacks.index(stack) + 1
    sizes = [other.voxels * len(other.times) for other in found.stacks]
    why = "the largest" if sizes.count(max(sizes)) == 1 else "the first of the largest"
    if sizes[number - 1] < max(sizes):
        why = "the first image series"
    choice = (
        f"{len(found.stacks)} series or orientations; building --series {number}, "
        f"{'asked for' if series else why}: {stack.label}"
    )
    kinds = [
        omission(
            f"{counted(other.frames, 'image')} of the same series "
            f"({', '.join(other.words) or 'plain'})",
            agreeing(other.frames, "it is", "they are") + " of another kind",
            f"--series {place} builds {agreeing(other.frames, 'it', 'them')}"
            if other.layout is not None
            else other.problem,
        )
        for place, other in enumerate(found.stacks, start=1)
        if is_other_kind(other, stack)
    ]
    others = [
        f"--series {place}: {other.label}"
        for place, other in enumerate(found.stacks, start=1)
        if other is not stack and not is_other_kind(other, stack)
    ]
    if others:
        most = f"; {len(others) - _MOST_KINDS} more are in `--series list`"
        listed = "; ".join(others[:_MOST_KINDS]) + (most if len(others) > _MOST_KINDS else "")
        kinds.insert(0, f"not built: {listed}")
    rest = len(kinds) - _MOST_KINDS
    if rest <= 0:
        return (choice, *kinds)
    more = counted(rest, "more kind of images is", "more kinds of images are")
    return (choice, *kinds[:_MOST_KINDS], f"{more} in `--series list`")


def _left_out(reasons: Counter[str]) -> tuple[str, ...]:
    if not reasons:
        return ()
    listed = ", ".join(_counted_files(count, reason) for reason, count in sorted(reasons.items()))
    return (f"{agreeing(reasons.total(), 'file', 'files')} left out: {listed}",)


def _counted_files(count: int, reason: str) -> str:
    return "1 copy of another" if (count, reason) == (1, _COPIES) else f"{count} {reason}"
