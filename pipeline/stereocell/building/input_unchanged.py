"""Check that a plan's inputs have not changed, before tasks read them and afterwards.

The fingerprint of a large volume covers a sample of its voxels. Sizes and dates of its files are
compared as well, because a file that changed while tasks ran may differ outside of the sample.
"""

from collections.abc import Iterator
from pathlib import Path

from stereocell.model.errors import SourceError
from stereocell.planning.input_files import first_states, forget, open_watched
from stereocell.planning.plan import Plan
from stereocell.planning.plan_source import source_of
from stereocell.read.fingerprint import covers_all
from stereocell.read.known_formats import format_of
from stereocell.read.remarks import LEFT_OUT
from stereocell.steps.open_source import SourceRef, open_afresh
from stereocell.steps.tissue_files import read_whole
from stereocell.storage.file_states import FileStates

_SHOWN = 100  # characters of a path in a message


class InputChangedError(SourceError):
    """An input changed while tasks read it, so their results may mix the old and the new input.

    has_new_fingerprint  whether the input's fingerprint, and so the names of results, changed, too
    """

    def __init__(self, text: str, *, has_new_fingerprint: bool) -> None:
        super().__init__(text)
        self.has_new_fingerprint = has_new_fingerprint


def require_input(plan: Plan) -> None:
    """Raise SourceError unless the input holds the voxels that were planned."""
    dataset = open_watched(source_of(plan))
    if dataset.fingerprint != plan.fingerprint:
        # An incomplete DICOM file is left out. The message names it as the likely reason.
        left_out = (remark for remark in dataset.remarks if remark.startswith(LEFT_OUT))
        remarks = "".join(f"; {remark}" for remark in left_out)
        raise SourceError(
            f"{plan.name}: changed since it was planned (fingerprint {dataset.fingerprint[:12]}, "
            f"expected {plan.fingerprint[:12]}{remarks}): plan into another OUT"
        )
    levels, channels = len(dataset.levels), len(dataset.channels)
    if plan.level >= levels or any(c.index >= channels for c in plan.channels if not c.source):
        raise SourceError(
            f"{plan.name}: found {levels} resolution levels and {channels} channels, expected "
            "those of the plan: plan into another OUT"
        )
    if any(a > b for a, b in zip(plan.region.stop, dataset.levels[plan.level].shape, strict=True)):
        raise SourceError(
            f"{plan.name}: found resolution level {plan.level} smaller than the plan's region, "
            "expected it at least as large: plan into another OUT"
        )


def require_labels(plan: Plan) -> None:
    """Raise SourceError unless the label maps hold the voxels that were planned."""
    for labels in plan.labels:
        found = open_watched(labels.ref).fingerprint
        if found != labels.ref.fingerprint:
            raise SourceError(
                f"labels {labels.name!r}: changed since they were planned (fingerprint "
                f"{found[:12]}, expected {labels.ref.fingerprint[:12]}): plan into another OUT"
            )


def require_added(plan: Plan) -> None:
    """Raise SourceError or OutputError unless the added channels' voxels are unchanged."""
    for folder in {Path(channel.source).parent for channel in plan.channels if channel.source}:
        read_whole(folder)
    for channel in plan.channels:
        if channel.source and open_watched(source_of(plan, channel=channel)).fingerprint != (
            channel.fingerprint
        ):
            raise SourceError(
                f"{channel.source}: channel {channel.name!r} changed since it was planned: run "
                "`stereocell tissue OUT` again"
            )


def require_still(plan: Plan, *, again: str = "stereocell units OUT", is_last: bool = True) -> None:
    """Raise InputChangedError if the image or a label map changed since it was first opened.

    again    command that reads the input again
    is_last  whether an input whose files can't be listed is compared by its fingerprint

    A file with a new date is accepted if the fingerprint covers all voxels and is the same. Raises
    SourceError or OutputError if added channels changed.
    """
    for name, ref in _inputs(plan):
        states = first_states(ref)
        if states is None:
            continue
        changed = states.changed()
        if changed or (is_last and not states.is_complete):
            words = f"{name}: changed while it was read: {_in_words(ref, states, changed)}"
            _require_same(ref, words, again, is_written=bool(changed))
    added = [source_of(plan, channel=channel) for channel in plan.channels if channel.source]
    if any(one.changed() for ref in added if (one := first_states(ref)) is not None):
        forget()
        require_added(plan)


def _inputs(plan: Plan) -> Iterator[tuple[str, SourceRef]]:
    yield plan.name, source_of(plan)
    for labels in plan.labels:
        yield f"labels {labels.name!r}", labels.ref


def _require_same(ref: SourceRef, words: str, again: str, *, is_written: bool) -> None:
    """Raise InputChangedError unless the input still has the reference's fingerprint.

    words       first words of the message, which name the input and the changed files
    again       command that reads the input again
    is_written  whether the date or size of a file changed
    """
    remedy = (
        "no result of this pass is kept: plan into another OUT (`stereocell build INPUT -o "
        f"ANOTHER_OUT`), or put back the input that was planned and run `{again}` again"
    )
    try:
        now = open_afresh(ref)
        found = now.fingerprint
    except SourceError as error:
        forget()
        text = f"{words}; reading it again failed: {error}; {remedy}"
        raise InputChangedError(text, has_new_fingerprint=True) from error
    if found != ref.fingerprint:
        forget()
        prints = f"fingerprint {found[:12]}, expected {ref.fingerprint[:12]}"
        raise InputChangedError(f"{words} ({prints}); {remedy}", has_new_fingerprint=True)
    if is_written and not covers_all(now):
        forget()
        raise InputChangedError(
            f"{words}; the fingerprint covers a sample and can't show whether all voxels are the "
            f"same, so no unit is kept: run `{again}` again",
            has_new_fingerprint=False,
        )


def _in_words(ref: SourceRef, states: FileStates, changed: list[str]) -> str:
    """Return how many files changed, and the name of the first unless it may name a patient."""
    count, total = len(changed), len({*states.states, *changed})
    words = f"{count} of {total} files"
    if not changed:
        return "its files can't be listed"
    if not format_of(ref.source).has_plain_names:
        return words if total > 1 else "its file"
    root = ref.source.partition("://")[2] or ref.source
    first = changed[0].removeprefix(root).lstrip("/") or changed[0].rpartition("/")[2]
    return f"{words}, the first is {first!r:.{_SHOWN}}"
