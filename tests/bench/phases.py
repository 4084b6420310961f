"""Run the phases of a build one after another as commands, and measure each.

    python phases.py OUT WORKERS INPUT [FLAGS OF PLAN ...]

Prints seconds, CPU seconds and peak memory of each phase. Beside each stand the CPU seconds in
units of the reference kernel, which ran just before and after it (see machine.py), and the load.
OUT is replaced. builds.py measures several inputs so, and compares with another checkout.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import psutil

sys.path.insert(0, str(Path(__file__).parents[1]))
from commands import STEREOCELL
from machine import Spent, load, measure_reference, stated

from support.worker_processes import workers_of

PHASES = ("units", "stage", "bundle", "report", "check")  # after the plan
AT_ONCE = "`build`, one command"  # name of the row
OFTEN_S = 0.2  # seconds between two looks at the processes
MB = 1e6
COLUMNS = ("phase", "seconds", "CPU", "references", "peak of the command, of a worker, MB")


@dataclass
class Cost(Spent):
    """Cost of a command. The reference kernel ran before and after it.

    peaks  peak bytes of a process by role
    """

    peaks: dict[str, int] = field(default_factory=lambda: defaultdict(int))


def sum_of(costs: Iterable[Cost]) -> Cost:
    """Return the cost of commands that ran one after another."""
    whole = Cost()
    for cost in costs:
        whole.seconds += cost.seconds
        whole.cpu += cost.cpu
        whole.load = max(whole.load, cost.load)
        whole.reference += cost.references  # turned into a time below
        for role, peak in cost.peaks.items():
            whole.peaks[role] = max(whole.peaks[role], peak)
    whole.reference = whole.cpu / whole.reference
    return whole


def watch(
    arguments: list[str], others: Sequence[psutil.Process] = (), checkout: Path | None = None
) -> Cost:
    """Run a command and measure its processes and `others`, which work for it.

    checkout  another checkout of this repository whose code runs, with the packages of this one
    """
    cost, before = Cost(), measure_reference()
    start, busy = time.perf_counter(), sum(_cpu_of(other) for other in others)
    # A pipe that is not read would fill up and stop the command.
    with tempfile.TemporaryFile("w+") as printed:
        command = subprocess.Popen(
            [*STEREOCELL, *arguments],
            stdout=printed,  # names the faults if `check` fails
            stderr=printed,
            env=environment_of(checkout),
        )
        parent, spent = psutil.Process(command.pid), dict[int, float]()
        while command.poll() is None:
            _look(parent, others, cost, spent)
            time.sleep(OFTEN_S)
        if command.returncode:
            printed.seek(0)
            raise SystemExit(f"{' '.join(arguments)}: {printed.read()[-2000:]}")
    cost.seconds = time.perf_counter() - start
    cost.cpu = sum(spent.values()) + sum(_cpu_of(other) for other in others) - busy
    cost.load, cost.reference = load(), (before + measure_reference()) / 2
    return cost


def environment_of(checkout: Path | None) -> dict[str, str]:
    """Return environment variables with which Python finds a checkout's code; None is this one."""
    code = (checkout or Path(__file__).parents[2]).resolve() / "pipeline"
    if not (code / "stereocell").is_dir():  # Python would find the installed package instead
        raise SystemExit(f"{checkout}: no pipeline/stereocell, expected a checkout of StereoCell")
    return os.environ | {"PYTHONPATH": str(code)}


def _look(
    parent: psutil.Process,
    others: Sequence[psutil.Process],
    cost: Cost,
    spent: dict[int, float],
) -> None:
    """Record the memory of the command and of workers, and the CPU seconds of all its processes.

    Workers are forked from a server, whose imports also take CPU time.
    """
    own, workers = [parent], list[psutil.Process]()
    with suppress(psutil.Error):
        own += parent.children(recursive=True)
        workers = workers_of(parent)
    for process in (*own, *others):
        with suppress(psutil.Error, OSError):  # the process ended meanwhile
            if process in own:
                spent[process.pid] = _cpu_of(process)
            if process is parent or process in (*workers, *others):
                peak = peak_of(process.pid) if process in own else process.memory_info().rss
                role = "command" if process is parent else "worker"
                cost.peaks[role] = max(cost.peaks[role], peak)


def peak_of(pid: int) -> int:
    """Return the largest memory, bytes, that a process ever had."""
    for line in Path(f"/proc/{pid}/status").read_text("utf-8").splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) * 1024
    return 0


def _cpu_of(process: psutil.Process) -> float:
    times = process.cpu_times()
    return float(times.user + times.system)


def run_phases(
    out: Path,
    plan: list[str],
    how: list[str],
    others: Sequence[psutil.Process] = (),
    checkout: Path | None = None,
) -> dict[str, Cost]:
    """Run all phases, print their costs, and return them.

    plan      arguments of `stereocell plan`
    how       arguments that state where units are built
    others    processes that work for the commands
    checkout  another checkout of this repository whose code runs
    """
    costs = {}
    for phase in ("plan", *PHASES):
        arguments = [phase, str(out)]
        if phase == "plan":
            arguments = ["plan", "-o", str(out), *plan]
        elif takes(phase, how[0], checkout):
            arguments += how
        if phase == "check":
            arguments.append("--deep")
        cost = costs[phase] = watch(arguments, others, checkout)
        print(f"  {phase:7}{cost}   peak, MB: {in_mb(cost.peaks)}", flush=True)
    for name, whole in totals(costs).items():
        print(f"  {name}: {whole.seconds / 60:.1f} minutes, {whole.cpu:.0f} s of CPU, "
              f"{whole.references:.0f} references")  # fmt: skip
    return costs


def build_at_once(out: Path, plan: list[str], how: list[str], checkout: Path | None) -> Cost:
    """Build by a single command, which starts once. Print its cost, and return it."""
    cost = watch(["build", *plan, "-o", str(out), *how], (), checkout)
    print(f"  {AT_ONCE:7}{cost}   peak, MB: {in_mb(cost.peaks)}", flush=True)
    return cost


def totals(costs: dict[str, Cost]) -> dict[str, Cost]:
    """Return the cost of the build, and of the build with its check."""
    apart = [costs[phase] for phase in ("plan", *PHASES)]
    return {"the build": sum_of(apart[:-1]), "with the check": sum_of(apart)}


def rows_of(costs: dict[str, Cost]) -> list[list[str]]:
    """Return the cells of COLUMNS for each phase, the build, and the build with its check."""
    return [
        [
            phase, f"{cost.seconds:.1f}", f"{cost.cpu:.1f}", f"{cost.references:,.0f}",
            "; ".join(f"{peak / MB:,.0f}" for peak in cost.peaks.values()),
        ]
        for phase, cost in (costs | totals(costs)).items()
    ]  # fmt: skip


def in_mb(peaks: dict[str, int]) -> str:
    return ", ".join(f"{role} {most / MB:,.0f}" for role, most in peaks.items())


def takes(phase: str, flag: str, checkout: Path | None) -> bool:
    """Return whether a phase has a flag. In older checkouts some phases have no workers."""
    if checkout is None:
        return True
    told = subprocess.run(
        [*STEREOCELL, phase, "--help"],
        capture_output=True, text=True, check=True, env=environment_of(checkout),
    )  # fmt: skip
    return flag in told.stdout


def main() -> None:
    """Build one input and print what each phase costs."""
    _, out, workers, *plan = sys.argv
    shutil.rmtree(out, ignore_errors=True)
    run_phases(Path(out), plan, ["--workers", workers])


if __name__ == "__main__":
    with stated():
        main()
