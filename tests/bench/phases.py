"""Run the phases of a build one after another as commands, and measure each.

    python phases.py OUT WORKERS INPUT [FLAGS OF PLAN ...]

Prints seconds, CPU seconds and peak memory of each phase. Beside each stand the CPU seconds in
units of the reference kernel, which ran just before and after it (see machine.py), and the load.
OUT is replaced.
"""

import shutil
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

import psutil

sys.path.insert(0, str(Path(__file__).parents[1]))
from commands import STEREOCELL
from machine import load, measure_reference, stated

from support.worker_processes import workers_of

PHASES = ("units", "stage", "bundle", "report", "check")  # after the plan
OFTEN_S = 0.2  # seconds between two looks at the processes
MB = 1e6


@dataclass
class Cost:
    """Cost of a command.

    seconds    time from start to end
    cpu        CPU seconds of all its processes
    reference  CPU seconds of the reference kernel, before and after the command
    peaks      peak bytes of a process by role
    """

    seconds: float = 0.0
    cpu: float = 0.0
    reference: float = 0.0
    peaks: dict[str, int] = field(default_factory=lambda: defaultdict(int))

    @property
    def references(self) -> float:
        """Return the CPU seconds in units of the reference kernel."""
        return self.cpu / self.reference


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
        before = measure_reference()
        cost = costs[phase] = watch(arguments, others)
        cost.reference = (before + measure_reference()) / 2
        peaks = ", ".join(f"{role} {most / MB:.0f}" for role, most in cost.peaks.items())
        print(f"  {phase:7}{cost.seconds:8.1f} s {cost.cpu:8.1f} s of CPU, "
              f"{cost.references:6.1f} references of {cost.reference:.3f} s   "
              f"load {load():.1f}   peak, MB: {peaks}", flush=True)  # fmt: skip
    build = [cost for phase, cost in costs.items() if phase != "check"]
    for name, some in (("the build", build), ("with the check", [*costs.values()])):
        print(f"  {name}: {sum(cost.seconds for cost in some) / 60:.1f} minutes, "
              f"{sum(cost.cpu for cost in some):.0f} s of CPU, "
              f"{sum(cost.references for cost in some):.0f} references")  # fmt: skip
    return costs


def main() -> None:
    """Build one input and print what each phase costs."""
    _, out, workers, *plan = sys.argv
    shutil.rmtree(out, ignore_errors=True)
    run_phases(Path(out), plan, ["--workers", workers], [])


if __name__ == "__main__":
    with stated():
        main()
