"""Run cases, each in a separate process, and report what is wrong with how they end.

The process is a fork of one that has imported the package, so a case costs no imports. Every case
must end without a traceback or a hang, in bounded memory (peak resident size), and must write or
change nothing outside OUT and leave no temporary files inside. It must end either with exit code 0
and a sound result, or with another exit code and exactly one line of StereoCell that states the
reason.
"""

import contextlib
import importlib
import io
import json
import os
import pkgutil
import random
import re
import resource
import shutil
import signal
import sys
import threading
import time
import traceback
import urllib.error
import urllib.request
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from malformed.cases import Case
from support import ctrl_c

# s; WALL_S applies to cases that wait, and is longer because other processes may use the cores
CPU_S, WALL_S = 10.0, 40.0
PEAK_MB = 1000
_SEED = 5
_LEFT_OUT = ("alphawrap", "__main__")
# progress that commands print on stderr: "units: 1/4 r0_c0/F", "plan: 0.2 s"
_PROGRESS = re.compile(
    r"(plan|windows|evidence|components|objects|iso-values|units|stage|bundle|report|check|tissue|source)\b"
)
_REFUSAL = "stereocell: "
_FAILED = re.compile(r"^\w+: \d+ of \d+ failed$")
_BUG = re.compile(r": [A-Z]\w+(Error|Exception): ")  # of a unit: the engine reports it as text
_USAGE = re.compile(r"stereocell( \w+)?: error: ")  # message of argparse, below its usage


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a case ended. code: the command's exit code; fault: what is wrong; empty: nothing."""

    case: Case
    code: int
    fault: str
    line: str
    seconds: float
    peak_mb: float


def import_all() -> None:
    """Import the package, so that forks have it already."""
    import_package("stereocell")


def import_package(name: str) -> None:
    """Import a package and all its modules."""
    package = importlib.import_module(name)
    for module in pkgutil.walk_packages(package.__path__, f"{name}."):
        if not module.name.endswith(_LEFT_OUT):
            importlib.import_module(module.name)


def run_in_child(function: Any, *arguments: Any) -> None:
    """Call a function in a fork, where it may start threads. Raises RuntimeError if it fails."""
    pid = os.fork()
    if pid == 0:
        try:
            function(*arguments)
        except BaseException:
            traceback.print_exc()
            os._exit(1)
        os._exit(0)
    if os.waitpid(pid, 0)[1]:
        raise RuntimeError(f"{function.__name__} failed")


def run_command(arguments: list[str]) -> int:
    """Run a command as a shell would: return its exit code, and let bugs through."""
    from stereocell.cli.__main__ import main

    try:
        return main(arguments)
    except SystemExit as stop:
        return int(stop.code or 0)


def run_cases(
    cases: Sequence[Case], base: Path, work: Path, jobs: int = 1, keep: bool = False
) -> Iterator[Outcome]:
    """Yield each case's outcome when it ends; `jobs` cases run at a time below `work`."""
    waiting = list(cases)[::-1]
    running: dict[int, tuple[Case, Path, float, str]] = {}
    while waiting or running:
        while waiting and len(running) < jobs:
            case = waiting.pop()
            name = re.sub(r"\W+", "_", f"{case.kind}-{case.name}", flags=re.ASCII)
            folder = work / f"{len(waiting)}-{name[:60]}"
            folder.mkdir()
            running[_start(case, base, folder)] = (case, folder, time.monotonic(), "")
        for pid, (case, folder, start, why) in list(running.items()):
            done, status, used = os.wait4(pid, os.WNOHANG)
            if done:
                del running[pid]
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(pid, signal.SIGKILL)  # processes that it left running
                yield _outcome(case, folder, status, used, why, time.monotonic() - start)
                if not keep:
                    shutil.rmtree(folder, ignore_errors=True)
            elif not why and (why := _excess(pid, time.monotonic() - start)):
                running[pid] = (case, folder, start, why)
                os.killpg(pid, signal.SIGKILL)
        time.sleep(0.004)


def _excess(pid: int, seconds: float) -> str:
    """Return why a process must be ended before it harms the machine; empty: it needn't."""
    if seconds > WALL_S:
        return f"hang: not done after {WALL_S:g} s"
    with contextlib.suppress(OSError):
        pages = int(Path(f"/proc/{pid}/statm").read_text("utf-8").split()[1])
        if pages * resource.getpagesize() > 1.5e6 * PEAK_MB:
            return f"memory: over {1.5 * PEAK_MB:g} MB"
    return ""


def _start(case: Case, base: Path, folder: Path) -> int:
    pid = os.fork()
    if pid:
        with contextlib.suppress(OSError):
            os.setpgid(pid, pid)
        return pid
    try:
        os.setpgid(0, 0)
        resource.setrlimit(resource.RLIMIT_CPU, (int(3 * CPU_S), int(3 * CPU_S)))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 30, 1 << 30))
        _in_child(case, base, folder)
    except BaseException:
        (folder / "result.json").write_text(
            json.dumps({"code": -1, "fault": "the case itself: " + traceback.format_exc()})
        )
    finally:
        os._exit(0)


def _in_child(case: Case, base: Path, folder: Path) -> None:
    place = folder / "place"  # holds the input, OUT, and files that the command must not touch
    (place / "bait").mkdir(parents=True)
    (place / "bait" / "secret.txt").write_text("the secret of the bait")
    os.chdir(place)
    random.seed(_SEED)
    warnings.simplefilter("ignore")  # warnings while the case is made
    arguments = case.make(base, place)
    shown = []
    for number, name in ((1, "stdout"), (2, "stderr")):
        file = os.open(folder / name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
        os.dup2(file, number)
        raw = io.FileIO(number, "w", closefd=False)
        errors = "strict" if number == 1 else "backslashreplace"
        setattr(sys, name, io.TextIOWrapper(raw, "utf-8", errors, write_through=True))
        shown.append(folder / name)
    _usual_warnings()
    if arguments[0] == "serve":  # Ctrl+C ends it
        threading.Thread(target=_visit, args=(shown[0],), daemon=True).start()
    before, start = _look(place), time.monotonic()
    fault = ""
    try:
        with ctrl_c.heeded():
            code = run_command(arguments)
    except BaseException as error:
        frame = traceback.extract_tb(error.__traceback__)[-1]
        ours = [
            f for f in traceback.extract_tb(error.__traceback__) if "/stereocell/" in f.filename
        ]
        last = ours[-1] if ours else frame
        code = 99
        fault = (
            f"traceback: {type(error).__name__}: {error!s:.150} at {last.filename}:{last.lineno}"
        )
        traceback.print_exc()
    seconds = time.monotonic() - start
    sys.stdout.flush()
    stdout, stderr = (path.read_text("utf-8", "replace") for path in shown)
    fault = fault or _find_fault(case, arguments, code, stdout, stderr)
    fault = fault or _find_remains(place, before, code)
    line = next((x for x in stderr.splitlines() if x.startswith(_REFUSAL)), "")
    result = {"code": code, "fault": fault, "line": line or stdout[-300:], "seconds": seconds}
    (folder / "result.json").write_text(json.dumps(result))


def _visit(stdout: Path) -> None:
    """Ask a server for existing and absent files, then end it like Ctrl+C."""
    end = time.monotonic() + 5
    while time.monotonic() < end:
        address = re.match(r"http://\S+/", stdout.read_text("utf-8", "replace"))
        if address:
            for name in ("", "manifest.json", "channels/F/volumes.json", "../../bait/secret.txt"):
                with contextlib.suppress(urllib.error.URLError, OSError):
                    urllib.request.urlopen(address[0] + name, timeout=3).read()
            break
        time.sleep(0.02)
    os.kill(os.getpid(), signal.SIGINT)


def _usual_warnings() -> None:
    """Reset warnings to the defaults of a shell's Python."""
    warnings.resetwarnings()
    for category in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
        warnings.simplefilter("ignore", category)


def _find_fault(case: Case, arguments: list[str], code: int, stdout: str, stderr: str) -> str:
    if "bait" in stdout + stderr and "the secret of the bait" in stdout + stderr:
        return "shows a file outside of the source"
    if case.expect == "refused" and code == 0:
        return "done, expected a refusal"
    if case.expect == "done" and code:
        return f"refused, expected a result: {stderr[-300:]}"
    lines = [text for text in re.split(r"[\n\r\v\f\x1c-\x1e\x85\u2028\u2029]", stderr) if text]
    if arguments[0] == "check" and code == 1 and not any(x.startswith(_REFUSAL) for x in lines):
        if not re.search(r"^FAIL \S", stdout, re.MULTILINE):
            return "exit code 1 without a line FAIL"
    elif any(_USAGE.match(text) for text in lines):
        return "" if code == 2 else f"usage and exit code {code}"
    elif code:
        refusals = [text for text in lines if text.startswith(_REFUSAL)]
        if refusals and _FAILED.search(lines[-1]):  # one line for each reason why units failed
            lines = lines[: lines.index(refusals[0]) + 1]
        if _BUG.search(stderr):
            return f"a bug of ours: {stderr[-300:]}"
        if len(refusals) != 1 or lines[-1] != refusals[0]:
            return f"not exactly one line: {lines[-3:]}"
        if not 20 < len(refusals[0]) < 1500:
            return f"a line of {len(refusals[0])} characters: {refusals[0]:.200}"
        if code not in (1, 2):
            return f"exit code {code}"
        lines.remove(refusals[0])
    noise = [text for text in lines if not _PROGRESS.match(text)]
    if noise:
        return f"noise: {noise[:3]}"
    if any(not (c.isprintable() or c in "\n") for c in stderr + stdout):
        return f"control characters are shown: {(stderr + stdout)[-200:]!r}"
    return _find_unsound(arguments) if code == 0 else ""


def _find_unsound(arguments: list[str]) -> str:
    """Return what is wrong with the result of a command that reports success."""
    from stereocell.storage.json_files import read_json

    if arguments[0] in ("plan", "build") and "list" not in arguments:
        out = Path(arguments[arguments.index("-o") + 1])
        plan = read_json(out / "plan.json", "plan.schema.json", "")
        if not plan["tiles"] or not plan["channels"]:
            return "an empty plan"
    elif arguments[0] == "slices":
        content = read_json(Path("out/slices.json"), "slices.schema.json", "")
        if not all(Path("out", one["file"]).stat().st_size for one in content["slices"]):
            return "an empty slice"
    return ""


Listing = dict[str, tuple[int, int]]


def _look(folder: Path) -> Listing:
    """Return the size and modification time of everything below a folder."""
    found = {}
    for path in sorted(folder.rglob("*")) if folder.is_dir() else ():
        status = path.lstat()
        is_folder = path.is_dir() and not path.is_symlink()
        found[str(path.relative_to(folder))] = (
            (-1, 0) if is_folder else (status.st_size, status.st_mtime_ns)
        )
    return found


def _find_remains(place: Path, before: Listing, code: int) -> str:
    after = _look(place)
    outside = {
        name for name in before.keys() | after.keys()
        if name.split("/")[0] != "out" and before.get(name) != after.get(name)
    }  # fmt: skip
    if outside:
        return f"written outside OUT: {sorted(outside)[:4]}"
    out = _look(place / "out")
    dots = [n for n in out if f"out/{n}" not in before and n.split("/")[-1].startswith(".")]
    if dots:
        return f"remains: {dots[:4]}"
    if code and "out" not in before and (place / "out").exists():
        return f"refused, and OUT is there: {sorted(out)[:4]}"
    return ""


def _outcome(case: Case, folder: Path, status: int, used: Any, why: str, seconds: float) -> Outcome:
    peak = used.ru_maxrss / 1000
    try:
        result = json.loads((folder / "result.json").read_text("utf-8"))
    except (OSError, ValueError):
        result = {"code": -1, "fault": f"ended by signal {status & 127}", "line": ""}
    fault = why or result["fault"]
    cpu = used.ru_utime + used.ru_stime
    if not fault and cpu > CPU_S:
        fault = f"slow: {cpu:.1f} s of CPU"
    if not fault and peak > PEAK_MB:
        fault = f"memory: {peak:.0f} MB at its peak"
    return Outcome(case, result["code"], fault, result.get("line", ""), seconds, peak)
