"""Kill builds in each of their phases, let them go on, and check their results.

    PYTHONPATH=tests python -m support.torture [KILLS [SEED]]

A build of two tiles and two channels is killed and started again, over and over, equally often in
each phase. A kill waits until its phase has begun, and then for a random part of the time that the
phase takes undisturbed. It ends the command alone, the command with all its workers, one worker, or
the scheduler or a worker of a cluster. One build has its OUT in a folder, the other on object
storage. When a build has ended, every byte must be as in an undisturbed build. No unit or tile that
was finished before a kill may have been written again, and no half-written file may be left.
"""

import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np
import psutil

from stereocell.storage.claim import LOCK
from support import phantoms
from support.clusters import running_cluster
from support.digests import digests_of
from support.object_store import ObjectStore, serving
from support.worker_processes import workers_of

PHASES = ("plan", "survey", "units", "stage", "bundle", "report")
SURVEY = "units/survey.json"
KINDS = ("command", "session", "worker", "scheduler", "cluster worker")
STEREOCELL = (sys.executable, "-m", "stereocell.cli")
PATIENCE_S = 300.0
ATTEMPTS = 10


class TortureError(AssertionError):
    """A build that went on after a kill did not end as an undisturbed build."""


class Place(Protocol):
    """Where an OUT lies."""

    @property
    def address(self) -> str: ...

    @property
    def environment(self) -> dict[str, str]: ...

    def find(self) -> dict[str, object]:
        """Return when each file was written, by the file's name in OUT."""

    def digests(self) -> dict[str, str]:
        """Return the SHA-256 of every file."""

    def clear(self) -> None: ...


@dataclass(frozen=True)
class Folder:
    out: Path

    @property
    def address(self) -> str:
        return str(self.out)

    @property
    def environment(self) -> dict[str, str]:
        return {}

    def find(self) -> dict[str, object]:
        found: dict[str, object] = {}
        for folder, _, files in os.walk(self.out):  # unlike rglob, skips moved files
            for file in files:
                path = Path(folder, file)
                with suppress(FileNotFoundError):
                    found[str(path.relative_to(self.out))] = path.stat().st_mtime_ns
        return found

    def digests(self) -> dict[str, str]:
        return digests_of(self.out)

    def clear(self) -> None:
        shutil.rmtree(self.out)


@dataclass(frozen=True)
class Bucket:
    store: ObjectStore
    out: str

    @property
    def address(self) -> str:
        return f"s3://{self.out}"

    @property
    def environment(self) -> dict[str, str]:
        return self.store.environment

    def find(self) -> dict[str, object]:
        found = self.store.files().find(self.out, detail=True)
        return {
            name[len(self.out) + 1 :]: at["LastModified"]
            for name, at in found.items()
            if at["type"] == "file"
        }

    def digests(self) -> dict[str, str]:
        with tempfile.TemporaryDirectory() as folder:
            self.store.files().get(self.out, f"{folder}/out", recursive=True)
            return digests_of(Path(folder) / "out")

    def clear(self) -> None:
        self.store.files().rm(self.out, recursive=True)


@dataclass
class Torture:
    """A build in one place, which is killed and goes on.

    `outcomes` counts kills by kind, and ended builds. `phases` counts kills by phase.
    """

    folder: Path
    place: Place
    seed: int
    workers: int = 2
    outcomes: Counter[str] = field(default_factory=Counter)
    phases: Counter[str] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        self._random = random.Random(self.seed)
        self._source = _write_source(self.folder)
        self._said = self.folder / "stderr"
        self._finished: dict[str, object] = {}  # times of the files of finished units and tiles
        self._was: object = None  # survey.json when the build started
        self._undisturbed, self._seconds = self._build_undisturbed()

    def kill(self, kind: str, phase: str) -> bool:
        """Start or resume the build and kill it in a phase; return whether it was killed there.

        If the phase is already done, the build runs to its end instead.
        """
        is_cluster = kind in ("scheduler", "cluster worker")
        environment = {**os.environ, **self.place.environment}
        with (
            running_cluster(self.folder, 2, environment) if is_cluster else nullcontext() as cluster
        ):
            build = self._start(["--scheduler", cluster.file] if cluster else self._own_workers())
            if not self._await_moment(build, phase):
                build.wait(PATIENCE_S)
                self._require_ended(build)
                return False
            if cluster:
                (cluster.scheduler if kind == "scheduler" else cluster.workers[0]).kill()
            elif kind == "worker":
                workers = _await_workers_of(build)
                if not workers:
                    self._require_ended(build)
                    return False
                self._random.choice(workers).kill()
            struck = self._phase_of(build)
            if not struck:  # the build ended between two checks
                build.wait(PATIENCE_S)
                self._require_ended(build)
                return False
            family = psutil.Process(build.pid).children(recursive=True)
            if kind == "session":
                kill_session(build)
            elif kind == "command":
                build.kill()
            code = build.wait(PATIENCE_S)
            _, alive = psutil.wait_procs(family, 30)
            if alive:
                raise TortureError(f"{kind}: 30 s after the command's end there are still {alive}")
        self.outcomes[kind] += 1
        self.phases[struck] += 1
        if code == 0:  # another worker has done the killed one's task
            self._require_whole()
        else:
            self._remember_finished()
        return struck == phase

    def kill_in(self, kind: str, phase: str) -> None:
        """Kill the build in a phase, in as many attempts as that takes."""
        for _ in range(ATTEMPTS):  # on a busy machine a phase may end before its moment
            if self.kill(kind, phase):
                return
        raise TortureError(f"{kind}: none of {ATTEMPTS} builds could be killed in {phase}")

    def end(self) -> None:
        """Let the build come to its end."""
        build = self._start(self._own_workers())
        build.wait(PATIENCE_S)
        self._require_ended(build)

    def _build_undisturbed(self) -> tuple[dict[str, str], dict[str, float]]:
        """Return the digests of the build's assets, and the seconds of each phase."""
        build = self._start(self._own_workers())
        seconds = dict.fromkeys(PHASES, 0.0)
        last = time.monotonic()
        while build.poll() is None:
            phase, now = self._phase_of(build), time.monotonic()
            if phase:
                seconds[phase] += now - last
            last = now
            time.sleep(0.01)
        if build.returncode:
            raise TortureError(f"the undisturbed build failed: {self._said.read_text('utf-8')}")
        digests = of_assets(self.place.digests())
        self.place.clear()
        return digests, seconds

    def _own_workers(self) -> list[str]:
        return ["--workers", str(self.workers)]

    def _start(self, arguments: list[str]) -> subprocess.Popen[bytes]:
        out = ["-o", self.place.address]
        self._was = self.place.find().get(SURVEY)
        with self._said.open("wb") as printed:
            return subprocess.Popen(
                [*STEREOCELL, "build", str(self._source), *out, "--grid", "2x1", *arguments],
                env={**os.environ, **self.place.environment},
                start_new_session=True,
                stdout=subprocess.DEVNULL,
                stderr=printed,
            )

    def _phase_of(self, build: subprocess.Popen[bytes]) -> str:
        """Return the phase of the running build, by its lines and files; empty: none."""
        printed = self._said.read_text(errors="replace")
        for done, phase in (("bundle", "report"), ("stage", "bundle"), ("units", "stage")):
            if re.search(rf"^{done}: (\d+\.\d s|up to date)$", printed, re.MULTILINE):
                return phase if build.poll() is None else ""
        now = self.place.find()
        if build.poll() is not None or LOCK not in now:
            return ""
        if not re.search(r"^plan: (\d+\.\d s|up to date)$", printed, re.MULTILINE):
            return "plan"
        return "survey" if now.get(SURVEY) == self._was else "units"

    def _await_moment(self, build: subprocess.Popen[bytes], phase: str) -> bool:
        """Wait for a random moment of a phase; return whether the build came to it."""
        while build.poll() is None and self._phase_of(build) != phase:
            time.sleep(0.005)
        with suppress(subprocess.TimeoutExpired):
            build.wait(self._random.uniform(0, self._seconds[phase]))
        return self._phase_of(build) == phase

    def _require_ended(self, build: subprocess.Popen[bytes]) -> None:
        if build.returncode:
            printed = self._said.read_text("utf-8")
            raise TortureError(f"the build that went on ended with {build.returncode}: {printed}")
        self._require_whole()

    def _require_whole(self) -> None:
        found = of_assets(self.place.digests())
        if found != self._undisturbed:
            names = {name for name, _ in found.items() ^ self._undisturbed.items()}
            raise TortureError(f"other bytes than undisturbed: {sorted(names)}")
        now = self.place.find()
        self._require_written_once(now)
        left = [name for name in now if "/." in f"/{name}" and not name.endswith(".nojekyll")]
        if left:
            raise TortureError(f"left over: {left}")
        self.outcomes["ended"] += 1
        self._finished.clear()
        self.place.clear()

    def _require_written_once(self, now: dict[str, object]) -> None:
        def look(name: str) -> object:  # a whole stage or bundle has no parts left
            is_part = name.startswith(("stage_parts/", "bundle_parts/"))
            gone = self._finished[name] if is_part else None
            return now.get(name, gone)

        again = [name for name, at in self._finished.items() if look(name) != at]
        if again:
            raise TortureError(f"finished things were written again: {again}")

    def _remember_finished(self) -> None:
        now = self.place.find()
        self._require_written_once(now)
        for name in (name for name in now if "/." not in f"/{name}"):
            folder, _, last = name.rpartition("/")
            if last == "stage.json":  # written after the tile's folder
                folder = f"stage/tiles/{folder.rpartition('/')[2]}"
            if last in ("unit.json", "stage.json", "part.json", "tile.json"):
                files = (file for file in now if file.startswith(f"{folder}/"))
                self._finished = {file: now[file] for file in files} | self._finished


def kills_of(count: int, places: Sequence[str]) -> Iterator[tuple[str, str, str]]:
    """Yield place, kind and phase of each kill.

    Phases follow one another at one place, so one build is killed in all of them. Then comes the
    next place. With enough kills, every phase sees every kind.
    """
    for number in range(count):
        turn, phase = divmod(number, len(PHASES))
        kind = KINDS[(turn // len(places) + phase) % len(KINDS)]
        if kind == "worker" and PHASES[phase] == "plan":  # `plan` has no workers
            kind = "command"
        yield places[turn % len(places)], kind, PHASES[phase]


def kill_session(process: subprocess.Popen[bytes]) -> None:
    """Kill a process and all processes that it started, at once."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)


def asset_digests(out: Path) -> dict[str, str]:
    """Return the SHA-256 of every asset, except files of measured seconds."""
    return of_assets(digests_of(out))


def of_assets(digests: dict[str, str]) -> dict[str, str]:
    return {
        name: digest
        for name, digest in digests.items()
        if name.split("/")[0] in ("units", "stage", "bundle") and not name.endswith("/seconds.json")
    }


def _write_source(folder: Path) -> Path:
    body = phantoms.f_phantom()
    channels = np.stack([body, body[:, ::-1]])
    return phantoms.write_ome_tiff(folder / "f.ome.tif", channels, "CZYX", names=["a", "b"])


def _await_workers_of(build: subprocess.Popen[bytes]) -> list[psutil.Process]:
    """Wait for a build's worker processes and return them; none if the build has ended."""
    command = psutil.Process(build.pid)
    while build.poll() is None:
        with suppress(psutil.Error):  # a process has ended since
            if workers := workers_of(command):
                return workers
        time.sleep(0.02)
    return []


def main(kills: int, seed: int) -> None:
    with (
        tempfile.TemporaryDirectory(prefix="stereocell-torture-") as name,
        serving(Path(name)) as store,
    ):
        start = time.monotonic()
        folder = Path(name)
        store.files().mkdir("bucket")
        tortures = {
            "folder": Torture(folder, Folder(folder / "out"), seed),
            store.kind: Torture(folder, Bucket(store, "bucket/out"), seed),
        }
        for done, (place, kind, phase) in enumerate(kills_of(kills, list(tortures)), 1):
            tortures[place].kill_in(kind, phase)
            seconds = time.monotonic() - start
            print(f"{done:3} {place:<9} {kind:<14} {phase:<6} {seconds:6.0f} s", flush=True)
        for place, torture in tortures.items():
            torture.end()
            ends = torture.outcomes.pop("ended")
            kinds = ", ".join(f"{count} x {kind}" for kind, count in torture.outcomes.items())
            print(
                f"{place}: {torture.outcomes.total()} kills ({kinds}); {ends} builds came to their "
                "end, each with the bytes of an undisturbed one"
            )
        struck = sum((torture.phases for torture in tortures.values()), Counter[str]())
        print("kills by phase: " + ", ".join(f"{phase} {struck[phase]}" for phase in PHASES))
        missed = [phase for phase in PHASES[:kills] if not struck[phase]]
        if missed:
            raise TortureError(f"no kill fell into {', '.join(missed)}")


if __name__ == "__main__":
    given = [int(argument) for argument in sys.argv[1:]]
    main(*(given + [50, 0][len(given) :]))
