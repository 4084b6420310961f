"""Builds that are killed at random moments, and what they leave once they have gone on.

    python tests/torture.py [KILLS [SEED]]

A build of two tiles and two channels is killed and started again, over and over: the command
alone, with all its workers, one of its workers, the scheduler or a worker of a cluster; one whose
OUT is a folder, and one whose OUT is on object storage. When it has come to its end, every byte
must be as in an undisturbed build, no unit or tile that was finished before a kill may have been
written again, and nothing half written may be left.
"""

import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np
import psutil

import phantoms
from digests import digests_of
from object_store import ObjectStore, serving
from stereocell.lock import LOCK

KINDS = ("command", "session", "worker", "scheduler", "cluster worker")
STEREOCELL = (sys.executable, "-m", "stereocell.cli")
QUIET = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
PATIENCE_S = 300.0


class TortureError(AssertionError):
    """A build did not come back to what it should be."""


class Place(Protocol):
    """Where an OUT lies."""

    @property
    def address(self) -> str: ...

    @property
    def environment(self) -> dict[str, str]: ...

    def find(self) -> dict[str, object]:
        """Return every file by its name in OUT, and when it was written."""

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
        for path in self.out.rglob("*"):
            with suppress(FileNotFoundError):  # it was moved since
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
    """A build in one place, which is killed and goes on. `outcomes` counts kills and ends."""

    folder: Path
    place: Place
    seed: int
    outcomes: Counter[str] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        self._random = random.Random(self.seed)
        self._source = _write_source(self.folder)
        self._said = self.folder / "stderr"
        self._finished: dict[str, object] = {}  # files of what is finished: when they were written
        self._undisturbed, self._seconds = self._build_undisturbed()

    def kill(self, kind: str) -> bool:
        """Start or go on with the build and kill it at a random moment; return whether it came to
        that before its end."""
        moment = self._random.uniform(0, self._seconds)
        is_cluster = kind in ("scheduler", "cluster worker")
        environment = {**os.environ, **self.place.environment}
        with _cluster(self.folder, environment) if is_cluster else nullcontext() as cluster:
            told = ["--scheduler", cluster.file] if cluster else ["--workers", "2"]
            build = self._start(told)
            if not self._await_moment(build, moment):
                self._require_ended(build)
                return False
            if cluster:
                kill_session(cluster.scheduler if kind == "scheduler" else cluster.workers[0])
            elif kind == "worker":
                workers = _await_workers_of(build)
                if not workers:
                    self._require_ended(build)
                    return False
                self._random.choice(workers).kill()
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
        if code == 0:  # another worker has done what the killed one was to do
            self._require_whole()
        else:
            self._remember_finished()
        return True

    def end(self) -> None:
        """Let the build come to its end."""
        build = self._start(["--workers", "2"])
        build.wait(PATIENCE_S)
        self._require_ended(build)

    def _build_undisturbed(self) -> tuple[dict[str, str], float]:
        build = self._start(["--workers", "2"])
        self._await_moment(build, 0)
        start = time.monotonic()
        if build.wait(PATIENCE_S):
            raise TortureError("the undisturbed build failed")
        seconds = time.monotonic() - start
        digests = of_assets(self.place.digests())
        self.place.clear()
        return digests, seconds

    def _start(self, told: list[str]) -> subprocess.Popen[bytes]:
        out = ["-o", self.place.address]
        with self._said.open("wb") as said:
            return subprocess.Popen(
                [*STEREOCELL, "build", str(self._source), *out, "--grid", "2x1", *told],
                env={**os.environ, **self.place.environment},
                start_new_session=True,
                stdout=subprocess.DEVNULL,
                stderr=said,
            )

    def _await_moment(self, build: subprocess.Popen[bytes], moment_s: float) -> bool:
        """Wait until the build is at work for so long; return whether it hasn't ended before."""
        while build.poll() is None and LOCK not in self.place.find():
            time.sleep(0.01)
        with suppress(subprocess.TimeoutExpired):
            build.wait(moment_s)
        return build.poll() is None

    def _require_ended(self, build: subprocess.Popen[bytes]) -> None:
        if build.returncode:
            said = self._said.read_text()
            raise TortureError(f"the build that went on ended with {build.returncode}: {said}")
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
        def look(name: str) -> object:  # the bundle's parts go when it is whole
            gone = self._finished[name] if name.startswith("bundle_parts/") else None
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
            if last in ("unit.json", "stage.json", "tile.json"):
                files = (file for file in now if file.startswith(f"{folder}/"))
                self._finished = {file: now[file] for file in files} | self._finished


def kill_session(process: subprocess.Popen[bytes]) -> None:
    """Kill a process and what it has started, at once."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)


def asset_digests(out: Path) -> dict[str, str]:
    """Return the SHA-256 of every asset; without seconds."""
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
    """Return the processes that do the units, once there are some; none: the build has ended."""
    command = psutil.Process(build.pid)
    while build.poll() is None:
        with suppress(psutil.Error):  # one has ended since
            workers = [
                process
                for process in command.children(recursive=True)
                if "spawn_main" in " ".join(process.cmdline())
            ]
            if workers:
                return workers
        time.sleep(0.02)
    return []


@dataclass(frozen=True)
class _Cluster:
    scheduler: subprocess.Popen[bytes]
    workers: list[subprocess.Popen[bytes]]
    file: str


@contextmanager
def _cluster(folder: Path, environment: dict[str, str]) -> Iterator[_Cluster]:
    """A `dask scheduler` with two workers."""
    file = folder / "scheduler.json"
    file.unlink(missing_ok=True)
    told = ["--scheduler-file", str(file), "--no-dashboard"]
    processes = []
    # without a nanny: it would start a worker that was killed again
    for kind, more in (
        ("scheduler", ["--port", "0"]),
        *[("worker", ["--nthreads", "1", "--no-nanny"])] * 2,
    ):
        command = [sys.executable, "-m", "dask", kind, *more, *told]
        processes.append(
            subprocess.Popen(command, cwd=folder, env=environment, start_new_session=True, **QUIET)
        )
    try:
        end = time.monotonic() + 60
        while not file.exists() and time.monotonic() < end:
            time.sleep(0.05)
        yield _Cluster(processes[0], processes[1:], str(file))
    finally:
        for process in processes:
            kill_session(process)
            process.wait()


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
        turns = [(place, kind) for kind in KINDS for place in tortures]
        done = 0
        while done < kills:
            place, kind = turns[done % len(turns)]
            if tortures[place].kill(kind):
                done += 1
                print(
                    f"{done:3} {place:<9} {kind:<14} {time.monotonic() - start:6.0f} s", flush=True
                )
        for place, torture in tortures.items():
            torture.end()
            ends = torture.outcomes.pop("ended")
            kinds = ", ".join(f"{count} x {kind}" for kind, count in torture.outcomes.items())
            print(
                f"{place}: {torture.outcomes.total()} kills ({kinds}); {ends} builds came to their "
                "end, each with the bytes of an undisturbed one"
            )


if __name__ == "__main__":
    given = [int(argument) for argument in sys.argv[1:]]
    main(*(given + [50, 0][len(given) :]))
