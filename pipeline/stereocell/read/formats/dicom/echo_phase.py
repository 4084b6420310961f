"""Find echoes of MR at which water and fat are opposed, where no header word names them.

The protons of fat precess 3.4 parts per million more slowly than those of water. So a gradient echo
shows both added or subtracted, depending on its echo time and the field. Series with two echoes, as
GE writes them, only state the times. Phases are named only if one acquisition has echoes of both
kinds.

References: Dixon (1984). Simple proton spectroscopic imaging. Radiology 153:189-194.
doi:10.1148/radiology.153.1.6089263
"""

import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import replace

from stereocell.read.formats.dicom.frame import Frame
from stereocell.read.formats.dicom.frame_kind import IN_PHASE, OPPOSED_PHASE

_SHIFT_HZ_PER_T = 3.4 * 42.577  # Hz per T; difference in frequency of fat and water
_CLEAR = 0.5  # smallest |cosine| of an echo's phase that is named

# ms; usual echo times of the opposed phase at 3 T and 1.5 T, and the usual ratio of the echo time
# in phase to it. They serve headers without a field strength.
_USUAL_OPPOSED = (1.0, 2.6)
_USUAL_RATIO = (1.7, 2.3)


def with_echo_phases(frames: Iterable[Frame]) -> list[Frame]:
    """Return the frames, with the phase of gradient echoes added to their contrasts.

    Frames of one acquisition have the same frame of reference, field, flip angle and repetition
    time.
    """
    every = list(frames)
    found: dict[tuple[object, ...], set[float]] = defaultdict(set)
    for frame in every:
        if _may_have_phase(frame) and frame.kind.echo_time:
            found[_acquisition(frame)].add(frame.kind.echo_time)
    phases = {key: _phases(sorted(times), key[1]) for key, times in found.items()}
    return [_named(frame, phases) for frame in every]


def _may_have_phase(frame: Frame) -> bool:
    kind = frame.kind
    is_plain = frame.modality == "MR" and not kind.contrasts and not kind.part_is_angle
    return is_plain and kind.is_gradient_echo is not False


def _acquisition(frame: Frame) -> tuple[object, ...]:
    kind = frame.kind
    place = (frame.reference, frame.rows, frame.columns)
    return (place, kind.field_t, kind.flip_angle, kind.repetition_time)


def _named(frame: Frame, phases: dict[tuple[object, ...], dict[float, str]]) -> Frame:
    if not _may_have_phase(frame) or not frame.kind.echo_time:
        return frame
    word = phases[_acquisition(frame)].get(frame.kind.echo_time)
    return frame if word is None else replace(frame, kind=replace(frame.kind, contrasts=(word,)))


def _phases(times_ms: Sequence[float], field_t: object) -> dict[float, str]:
    """Return the name of the phase at each echo time; empty: not both phases occur."""
    if isinstance(field_t, float) and field_t > 0:
        turns = {ms: math.cos(math.tau * _SHIFT_HZ_PER_T * field_t * ms / 1000) for ms in times_ms}
        named = {
            ms: IN_PHASE if cosine > 0 else OPPOSED_PHASE
            for ms, cosine in turns.items()
            if abs(cosine) >= _CLEAR
        }
    else:
        named = _usual(times_ms)
    return named if len(set(named.values())) == len((IN_PHASE, OPPOSED_PHASE)) else {}


def _usual(times_ms: Sequence[float]) -> dict[float, str]:
    if len(times_ms) != len((IN_PHASE, OPPOSED_PHASE)):
        return {}
    short, long = times_ms
    is_usual = _USUAL_OPPOSED[0] <= short <= _USUAL_OPPOSED[1]
    if is_usual and _USUAL_RATIO[0] <= long / short <= _USUAL_RATIO[1]:
        return {short: OPPOSED_PHASE, long: IN_PHASE}
    return {}
