"""Read one changed source completely in a fork, and compare it with the intact one.

These are the outcomes, in the order in which they are checked:
fault        a traceback, an abort, a hang, too much memory, or output of a library on stderr
refused      in one line, which names the source and the expected state
right        read like the intact source: the changed bytes do not matter
unnoticed    voxels differ, and the changed bytes lie where the format has no checksum for voxels;
             if some lie elsewhere, these alone are read correctly or refused
noted        read in part, with a note that the intact source does not have
other value  the header now states another value: the voxels are those of the intact source, or the
             header is a text file that now states another size, type or position of the voxels
wrong        anything else
"""

import hashlib
import json
import os
import random
import resource
import signal
import sys
import time
import traceback
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from malformed.mutations import TEXTS, mutate
from malformed.subjects import Ranges, Subject, copy_of, files_of

OUTCOMES = ("refused", "right", "unnoticed", "noted", "other value", "wrong", "fault")
CPU_S, WALL_S, PEAK_MB = 20, 90, 1500
Reading = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Ended:
    """The end of a trial: one of OUTCOMES, and a description for the person who investigates it."""

    subject: Subject
    seed: int
    outcome: str
    words: str

    @property
    def name(self) -> str:
        return f"{self.subject.format}, {self.subject.name}, seed {self.seed}"


class Intact:
    """A subject as written, and the values that are read from it."""

    def __init__(self, subject: Subject, folder: Path) -> None:
        self.subject = subject
        self.folder = folder
        folder.mkdir(parents=True)
        self.source = subject.write(folder).relative_to(folder)
        self.files = list(files_of(subject, folder))
        self.unprotected: dict[Path, Ranges] = {f: subject.unprotected(f) for f in self.files}
        self.names = {self.source.name, *(path.name for path in self.files)}
        answer = _in_fork(folder / self.source, folder.with_suffix(".intact"))
        if "reading" not in answer:
            raise AssertionError(f"{subject.format}, {subject.name}: {answer}")
        self.reading: Reading = answer["reading"]
        self.notes: list[str] = self.reading.pop("notes")

    def trial(self, seed: int, folder: Path) -> Ended:
        """Change one file by a seed, in an empty folder, and read the source there."""
        chance = random.Random(f"{self.subject.format} {self.subject.name} {seed}")
        place = folder / "place"
        copy_of(self.folder, place)
        file = chance.choice(self.files)
        before = file.read_bytes()
        after = mutate(file, before, chance)
        (place / file.relative_to(self.folder)).write_bytes(after)
        changed = place / file.relative_to(self.folder)

        def answer_to(content: bytes) -> dict[str, Any]:
            changed.write_bytes(content)
            return _in_fork(place / self.source, folder / "answer")

        outcome, words = self._judge(answer_to(after), file.name)
        if outcome == "wrong" and len(before) == len(after):
            elsewhere = _without_changes_in(self.unprotected[file], before, after)
            rest = "right" if elsewhere == before else self._judge(answer_to(elsewhere), "")[0]
            outcome = "unnoticed" if rest in ("right", "refused") else outcome
        return Ended(self.subject, seed, outcome, words)

    def _judge(self, answer: dict[str, Any], file: str) -> tuple[str, str]:
        if "fault" in answer:
            return "fault", answer["fault"]
        if "line" in answer:
            line = answer["line"]
            is_sound = any(name in line for name in self.names)
            is_sound = is_sound and ("expected" in line or "needs" in line)
            is_sound = is_sound and "\n" not in line and len(line) < 1500
            return ("refused", line) if is_sound else ("fault", f"not one clear line: {line}")
        found = answer["reading"]
        new = sorted(set(found.pop("notes")) - set(self.notes))
        count = len(found["voxels"])  # the changed pyramid may state fewer levels
        expected = self.reading | {"voxels": self.reading["voxels"][:count]}
        other = sorted(key for key in expected if found.get(key) != expected[key])
        if not other:
            return "right", ""
        words = "; ".join(
            f"{key}: {self.reading[key]!s:.60} -> {found[key]!s:.60}" for key in other
        )
        words = f"{file}: {words}"
        if "voxels" not in other:
            return "other value", words
        if new:
            return "noted", f"{new}; {words}"
        is_restated = not {"levels", "dtype", "placement"}.isdisjoint(other)
        return ("other value" if file.endswith(TEXTS) and is_restated else "wrong"), words


def _without_changes_in(ranges: Ranges, before: bytes, after: bytes) -> bytes:
    """Return the changed content, with the bytes in the ranges as before."""
    restored = bytearray(after)
    for start, stop in ranges:
        restored[start:stop] = before[start:stop]
    return bytes(restored)


def _in_fork(source: Path, answer: Path) -> dict[str, Any]:
    """Read a source in a fork. Return its `reading`, the `line` that refused it, or a `fault`."""
    noise = answer.with_suffix(".noise")
    pid = os.fork()
    if pid == 0:
        try:
            _read_and_answer(source, answer, noise)
        finally:
            os._exit(0)
    start = time.monotonic()
    while True:
        done, status, used = os.wait4(pid, os.WNOHANG)
        if done:
            break
        if time.monotonic() - start > WALL_S:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
            return {"fault": f"hang: not done after {WALL_S} s"}
        time.sleep(0.003)
    if status:
        return {"fault": f"ended by signal {status & 127}"}
    found: dict[str, Any] = json.loads(answer.read_text("utf-8"))
    printed = noise.read_text(errors="replace")
    if printed and "fault" not in found:
        return {"fault": f"noise: {printed[:300]}"}
    if used.ru_maxrss / 1000 > PEAK_MB:
        return {"fault": f"memory: {used.ru_maxrss / 1000:.0f} MB"}
    return found


def _read_and_answer(source: Path, answer: Path, noise: Path) -> None:
    from stereocell.model.errors import StereoCellError

    resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    file = os.open(noise, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
    for number in (1, 2):
        os.dup2(file, number)
    sys.stdout = sys.stderr = os.fdopen(os.dup(2), "w", buffering=1)
    warnings.resetwarnings()  # the default in a shell's Python
    for category in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
        warnings.simplefilter("ignore", category)
    try:
        found: dict[str, Any] = {"reading": _read(source)}
    except StereoCellError as error:
        found = {"line": str(error)}
    except BaseException as error:
        found = {"fault": _place_of(error)}
    answer.write_text(json.dumps(found))


def _place_of(error: BaseException) -> str:
    frames = traceback.extract_tb(error.__traceback__)
    ours = [frame for frame in frames if "/stereocell/" in frame.filename] or list(frames)
    at = f"{ours[-1].filename.partition('/stereocell/')[2]}:{ours[-1].lineno}"
    return f"traceback: {type(error).__name__}: {error!s:.150} at {at}"


def _read(source: Path) -> Reading:
    """Return everything that a build would use from a source, as JSON values."""
    from stereocell import read
    from stereocell.read.tables import read_table

    if source.suffix in (".parquet", ".h5ad"):
        table = read_table(str(source), "", (), "cells")
        values = [table.labels, *(c.numbers if c.texts is None else c.texts for c in table.columns)]
        digest = hashlib.sha256(b"".join(np.asarray(v).tobytes() for v in values)).hexdigest()
        names = [table.key, *(column.name for column in table.columns)]
        return {"voxels": [digest], "names": names, "left_out": table.left_out, "notes": []}
    options = {"spacing_um": (1.0, 1.0, 1.0)} if source.name == "planes" else {}
    dataset = read.open(source, **options)
    voxels = [
        [
            hashlib.sha256(dataset.read(channel, level.box, index).voxels.tobytes()).hexdigest()
            for channel in range(len(dataset.channels))
        ]
        for index, level in enumerate(dataset.levels)
    ]
    about: Reading = {
        "voxels": voxels,
        "names": [(channel.name, channel.color) for channel in dataset.channels],
        "levels": [(level.shape, level.spacing_um, level.origin_um) for level in dataset.levels],
        "dtype": dataset.dtype.name,
        "times": dataset.time_points,
        "images": dataset.images,
        "modality": dataset.modality,
        "placement": (dataset.placement, dataset.has_sides, dataset.offset_um),
        "labels": dataset.labels,
        "notes": dataset.notes,
    }
    found: Reading = json.loads(json.dumps(about, default=np.ndarray.tolist))
    return found
