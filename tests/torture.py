"""Builds that are killed at random moments, and what they leave once they have gone on.

    python tests/torture.py [KILLS [SEED]]

A build of two tiles and two channels is killed and started again, over and over: the command
alone, with all its workers, one of its workers, or the scheduler of a cluster. When it has come to
its end, every byte must be as in an undisturbed build, no unit that was finished before a kill may
have been written again, and nothing half written may be left.
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

import numpy as np
import psutil

import phantoms
from digests import digests_of
from stereocell.lock import LOCK

KINDS = ("command", "session", "worker", "scheduler")
STEREOCELL = (sys.executable, "-m", "stereocell.cli")
QUIET = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
PATIENCE_S = 300.0


class TortureError(AssertionError):
    """A build did not come back to what it should be."""


@dataclass
class Torture:
    """One OUT that is killed and goes on. `outcomes` counts by kind of kill, and ends."""

    folder: Path
    seed: int
    outcomes: Counter[str] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        self._random = random.Random(self.seed)
        self._source = _write_source(self.folder)
        self._out = self.folder / "out"
        self._finished: dict[str, int] = {}  # files of finished units: when they were written
        self._undisturbed, self._seconds = self._build_undisturbed()

    def kill(self, kind: str) -> bool:
        """Start or go on with the build and kill it at a random moment; return whether it came to
        that before its end."""
        moment = self._random.uniform(0, self._seconds)
        with _cluster(self.folder) if kind == "scheduler" else nullcontext() as scheduler:
            told = ["--scheduler", scheduler.file] if scheduler else ["--workers", "2"]
            build = self._start(told)
            if not self._await_moment(build, moment):
                self._require_ended(build)
                return False
            if kind == "scheduler":
                assert scheduler is not None
                scheduler.process.kill()
            elif kind == "worker":
                self._random.choice(_workers_of(build) or [build]).kill()
            family = psutil.Process(build.pid).children(recursive=True)
            if kind == "session":
                os.killpg(build.pid, signal.SIGKILL)
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
        digests = asset_digests(self._out)
        shutil.rmtree(self._out)
        return digests, seconds

    def _start(self, told: list[str]) -> subprocess.Popen[bytes]:
        command = [*STEREOCELL, "build", str(self._source), "-o", str(self._out), "--grid", "2x1"]
        return subprocess.Popen([*command, *told], start_new_session=True, **QUIET)

    def _await_moment(self, build: subprocess.Popen[bytes], moment_s: float) -> bool:
        """Wait until the build is at work for so long; return whether it hasn't ended before."""
        while build.poll() is None and not (self._out / LOCK).exists():
            time.sleep(0.005)
        with suppress(subprocess.TimeoutExpired):
            build.wait(moment_s)
        return build.poll() is None

    def _require_ended(self, build: subprocess.Popen[bytes]) -> None:
        if build.returncode:
            raise TortureError(f"the build that went on ended with {build.returncode}")
        self._require_whole()

    def _require_whole(self) -> None:
        found = asset_digests(self._out)
        if found != self._undisturbed:
            names = {name for name, _ in found.items() ^ self._undisturbed.items()}
            raise TortureError(f"other bytes than undisturbed: {sorted(names)}")
        again = [name for name, at in self._finished.items() if self._written_at(name) != at]
        if again:
            raise TortureError(f"finished units were written again: {again}")
        left = [path for path in self._out.rglob(".*") if path.name != ".nojekyll"]
        if left:
            raise TortureError(f"left over: {left}")
        self.outcomes["ended"] += 1
        self._finished.clear()
        shutil.rmtree(self._out)

    def _remember_finished(self) -> None:
        for record in self._out.glob("units/*/*/*/unit.json"):
            if not record.parent.name.startswith("."):
                for file in record.parent.iterdir():
                    name = str(file.relative_to(self._out))
                    self._finished.setdefault(name, self._written_at(name))

    def _written_at(self, name: str) -> int:
        return (self._out / name).stat().st_mtime_ns


def asset_digests(out: Path) -> dict[str, str]:
    """Return the SHA-256 of every asset; without seconds."""
    return {
        name: digest
        for name, digest in digests_of(out).items()
        if name.split("/")[0] in ("units", "stage", "bundle") and not name.endswith("/seconds.json")
    }


def _write_source(folder: Path) -> Path:
    body = phantoms.f_phantom()
    channels = np.stack([body, body[:, ::-1]])
    return phantoms.write_ome_tiff(folder / "f.ome.tif", channels, "CZYX", names=["a", "b"])


def _workers_of(build: subprocess.Popen[bytes]) -> list[psutil.Process]:
    """Return the processes that do the units."""
    return [
        process
        for process in psutil.Process(build.pid).children(recursive=True)
        if "spawn_main" in " ".join(process.cmdline())
    ]


@dataclass(frozen=True)
class _Scheduler:
    process: subprocess.Popen[bytes]
    file: str


@contextmanager
def _cluster(folder: Path) -> Iterator[_Scheduler]:
    """A `dask scheduler` with two workers."""
    file = folder / "scheduler.json"
    file.unlink(missing_ok=True)
    told = ["--scheduler-file", str(file), "--no-dashboard"]
    processes = []
    for kind, more in (("scheduler", ["--port", "0"]), *[("worker", ["--nthreads", "1"])] * 2):
        command = [sys.executable, "-m", "dask", kind, *more, *told]
        processes.append(subprocess.Popen(command, cwd=folder, start_new_session=True, **QUIET))
    try:
        end = time.monotonic() + 60
        while not file.exists() and time.monotonic() < end:
            time.sleep(0.05)
        yield _Scheduler(processes[0], str(file))
    finally:
        for process in processes:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def main(kills: int, seed: int) -> None:
    with tempfile.TemporaryDirectory(prefix="stereocell-torture-") as folder:
        start = time.monotonic()
        torture = Torture(Path(folder), seed)
        done = 0
        while done < kills:
            kind = KINDS[done % len(KINDS)]
            if torture.kill(kind):
                done += 1
                print(f"{done:3} {kind:<10} {time.monotonic() - start:6.0f} s", flush=True)
        torture.end()
        ends = torture.outcomes.pop("ended")
        kinds = ", ".join(f"{count} x {kind}" for kind, count in torture.outcomes.items())
        print(f"{done} kills ({kinds}); {ends} builds came to their end, each with the bytes of an "
              "undisturbed one")  # fmt: skip


if __name__ == "__main__":
    given = [int(argument) for argument in sys.argv[1:]]
    main(*(given + [50, 0][len(given) :]))
