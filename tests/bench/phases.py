"""Run the phases of a build one after another as commands, and measure each."""

import subprocess
import tempfile
import time
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

import psutil
from commands import STEREOCELL

from support.worker_processes import workers_of

PHASES = ("units", "stage", "bundle", "report", "check")  # after the plan
OFTEN_S = 0.2  # seconds between two looks at the processes
MB = 1e6


@dataclass
class Cost:
    """Cost of a command: seconds, CPU seconds, and peak bytes of a process by role."""

    seconds: float = 0.0
    cpu: float = 0.0
    peaks: dict[str, int] = field(default_factory=lambda: defaultdict(int))


def watch(arguments: list[str], others: list[psutil.Process]) -> Cost:
    """Run a command and measure its processes and `others`, which work for it."""
    cost, start = Cost(), time.perf_counter()
    before = sum(_cpu_of(other) for other in others)
    # A pipe that is not read would fill up and stop the command.
    with tempfile.TemporaryFile("w+") as errors:
        command = subprocess.Popen(
            [*STEREOCELL, *arguments], stdout=subprocess.DEVNULL, stderr=errors
        )
        parent, spent = psutil.Process(command.pid), dict[int, float]()
        while command.poll() is None:
            _look(parent, others, cost, spent)
            time.sleep(OFTEN_S)
        if command.returncode:
            errors.seek(0)
            raise SystemExit(f"{' '.join(arguments)}: {errors.read()[-2000:]}")
    cost.seconds = time.perf_counter() - start
    cost.cpu = sum(spent.values()) + sum(_cpu_of(other) for other in others) - before
    return cost


def _look(
    parent: psutil.Process, others: list[psutil.Process], cost: Cost, spent: dict[int, float]
) -> None:
    """Record the memory of all processes, and the CPU seconds of the command's own processes."""
    try:
        for process, role in [
            (parent, "command"),
            *((worker, "worker") for worker in (*workers_of(parent), *others)),
        ]:
            cost.peaks[role] = max(cost.peaks[role], process.memory_info().rss)
            if process not in others:
                spent[process.pid] = _cpu_of(process)
    except psutil.Error:
        pass  # the process ended meanwhile


def _cpu_of(process: psutil.Process) -> float:
    times = process.cpu_times()
    return float(times.user + times.system)


def run_phases(
    out: Path, plan: list[str], how: list[str], others: list[psutil.Process]
) -> dict[str, Cost]:
    """Run all phases, print their costs, and return them.

    plan    arguments of `stereocell plan`
    how     arguments that state where units are built
    others  processes that work for the commands
    """
    costs = {}
    for phase in ("plan", *PHASES):
        arguments = [phase, str(out)]
        if phase == "plan":
            arguments = ["plan", "-o", str(out), *plan]
        elif phase == "check":
            arguments += ["--deep", *how]
        elif phase != "report":
            arguments += how
        cost = costs[phase] = watch(arguments, others)
        peaks = ", ".join(f"{role} {most / MB:.0f}" for role, most in cost.peaks.items())
        print(f"  {phase:7}{cost.seconds:8.1f} s {cost.cpu:8.1f} s of CPU   peak, MB: {peaks}",
              flush=True)  # fmt: skip
    total = sum(cost.seconds for cost in costs.values())
    print(f"  in all {total / 60:.1f} minutes, {sum(c.cpu for c in costs.values()):.0f} s of CPU")
    return costs
