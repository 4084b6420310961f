"""A phase of a build: decide whether its results are complete and up to date, and record them.

The runner of steps does not run phases. Users know the places of a phase's results and may edit
them there, so the results are not named by a key. Instead, phases.json records the key and a digest
of the results.
"""

import hashlib
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import NamedTuple

from stereocell.building.made_of import FIELD, find_stale, made_of
from stereocell.building.out_folder import OutFolder
from stereocell.building.own_parts import (
    require_own_bundle,
    require_own_report,
    require_own_stage,
)
from stereocell.building.sealed_documents import require_documents
from stereocell.bundle.manifest import FILES, MANIFEST
from stereocell.engine.run import console
from stereocell.engine.step import Keyed
from stereocell.model.errors import OutputError
from stereocell.storage.file_list import find_faults, list_files, read_list, sizes_of
from stereocell.usd import written_files


class Phase:
    """A running phase: whether it has work to do, and its duration."""

    def __init__(self, out_folder: OutFolder, name: str) -> None:
        self.out_folder, self.name = out_folder, name
        self.key, self.about = "done", ""
        self.results: Callable[[], str] = str
        self.is_up_to_date = False
        self.is_whole = True  # False: some results are still missing

    def is_done(self, step: Keyed) -> bool:
        """Return whether the phase's results are complete and made from the same inputs.

        If they are not, the phase is recorded as begun. Before that, OutputError is raised if the
        phase would replace files that it did not write.
        """
        kind = _RESULTS[self.name]
        self.key, self.results = step.key, partial(kind.digest, self.out_folder)
        entry = self.out_folder.phases().get(self.name, {})
        self.is_up_to_date = entry.get("key") == self.key and entry["results"] == self.results()
        if not self.is_up_to_date:
            kind.require_own(self.out_folder)
            # recorded without a key, so that a killed phase does not count as done
            self.save(0.0, is_finished=False)
        return self.is_up_to_date

    def print(self, *lines: str) -> None:
        """Print lines that begin with the phase's name."""
        for line in lines:
            console.print(f"{self.name}: {line}", markup=False, soft_wrap=True)

    def save(self, seconds: float, *, is_finished: bool = True) -> None:
        """Write the phase's record to phases.json. A phase that isn't finished has no key there."""
        entry = {"key": "", "results": "", "about": "", "seconds": round(seconds, 2)}
        if is_finished:
            entry |= {"key": self.key, "results": self.results(), "about": self.about}
        digest = made_of(self.out_folder, self.name) if is_finished and self.is_whole else ""
        self.out_folder.save_phase(self.name, {**entry, FIELD: digest})

    def keep(self) -> None:
        """Record that the results are up to date with the plan, units and stage in OUT now."""
        entry = self.out_folder.phases().get(self.name)
        digest = made_of(self.out_folder, self.name) if self.is_whole else ""
        if entry is not None and entry.get(FIELD, "") != digest:
            self.out_folder.save_phase(self.name, {**entry, FIELD: digest})


@contextmanager
def phase_of(out_folder: OutFolder, name: str) -> Iterator[Phase]:
    """Yield a phase; at the end of the block print and save its duration, or print "up to date"."""
    start = time.perf_counter()
    if (fault := out_folder.phases_fault()) is not None:
        console.print(f"{name}: {fault}", markup=False, soft_wrap=True)
    require_documents(out_folder, name)
    phase = Phase(out_folder, name)
    yield phase
    seconds = time.perf_counter() - start
    if phase.is_up_to_date:
        phase.keep()
        console.print(f"{name}: up to date")
    else:
        phase.save(seconds)
        console.print(f"{name}: {seconds:.1f} s")


def states_of(files: Iterable[Path]) -> list[tuple[str, int, int]]:
    """Return each file's path, size in bytes and modification time in ns, to notice edits."""
    found = [(file, file.stat()) for file in files]
    return [(str(file), status.st_size, status.st_mtime_ns) for file, status in found]


def _digest_of_names(folder: Path) -> str:
    """Return a digest of the names and sizes of all files below a folder, to notice damage."""
    digest = hashlib.sha256()
    for path, size in sizes_of(folder).items():
        digest.update(f"{folder.name}/{path} {size}\n".encode())
    return digest.hexdigest()[:20]


def _digest_of_bundle(out_folder: OutFolder) -> str:
    """Return a digest of the bundle; empty: one of its files is missing or damaged."""
    path = out_folder.bundle_dir / FILES
    try:
        listed = read_list(path, "")
    except OutputError:
        return ""
    faults = find_faults(out_folder.bundle_dir, listed, since=path)
    return (
        "" if faults else _digest_of_names(out_folder.bundle_dir) + digest_of_manifest(out_folder)
    )


def digest_of_manifest(out_folder: OutFolder) -> str:
    """Return a digest of the bundle's manifest, which its list omits; empty: there is none."""
    return _digest_of_file(out_folder.bundle_dir / MANIFEST)


def _digest_of_file(file: Path) -> str:
    """Return a digest of a file's content; empty: there is none."""
    listed = list_files(file, root=file.parent)
    return str(listed[file.name]["sha256"])[:20] if listed else ""


def _digest_of_stage(out_folder: OutFolder) -> str:
    """Return a digest of the stage's list; empty: one of its files is missing or damaged."""
    try:
        listed = written_files.read_stage_list(out_folder.stage_dir)
    except OutputError:
        return ""
    if not written_files.is_kept(out_folder.stage_dir, listed, since=out_folder.stage_list):
        return ""
    return written_files.digest_of(listed)


class _Results(NamedTuple):
    """Functions on the results of a phase.

    digest       returns a digest of the results; empty: one is missing or damaged
    require_own  raises OutputError if the phase would replace files that it did not write
    """

    digest: Callable[[OutFolder], str]
    require_own: Callable[[OutFolder], None]


_RESULTS = {
    "stage": _Results(_digest_of_stage, require_own_stage),
    "bundle": _Results(_digest_of_bundle, require_own_bundle),
    "report": _Results(
        lambda out_folder: _digest_of_file(out_folder.report_file), require_own_report
    ),
}


def is_finished(out_folder: OutFolder) -> bool:
    """Return whether all phases of OUT's plan have finished, and their results are complete."""
    phases = out_folder.phases()
    return find_stale(out_folder) is None and all(
        name in phases and phases[name]["results"] == results.digest(out_folder)
        for name, results in _RESULTS.items()
    )
