"""What this machine has for the work, what it lacks, and what each missing thing costs."""

import os
import platform
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, requires, version
from importlib.util import find_spec
from pathlib import Path

from stereocell.assets import viewer_dist

_GIB = 1 << 30
UNIT_BYTES = 3.5 * _GIB  # what a unit of 194 x 512 x 512 voxels is allowed for
_LEAST_FREE = 20 * _GIB
_BROWSERS = ("chromium", "chromium-browser", "google-chrome", "firefox", "safari", "open")


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing looked for.

    found      what is there, or what was seen instead
    cost       what does not work, or slower, without it; empty if it is there
    is_needed  whether nothing can be built without it
    """

    name: str
    ok: bool
    found: str
    cost: str
    is_needed: bool = False


def examine() -> Iterator[Finding]:
    """Yield what was found, one thing after another. Changes nothing on this machine."""
    for look in LOOKS:
        yield look()


def _python() -> Finding:
    found = f"{platform.python_implementation()} {platform.python_version()}"
    ok = sys.version_info >= (3, 11)
    return _finding("Python", ok, found, "nothing runs: 3.11 or newer is needed", is_needed=True)


def _packages() -> Finding:
    """Look for the packages that StereoCell names, by their metadata alone: nothing is imported."""
    missing, count = [], 0
    for line in requires("stereocell") or ():
        if "extra ==" in line:
            continue
        count += 1
        name = line.split(";")[0].split(">")[0].split("=")[0].split("[")[0].strip()
        try:
            version(name)
        except PackageNotFoundError:
            missing.append(name)
    found = f"missing: {', '.join(missing)}" if missing else f"all {count}"
    cost = "what needs them fails: install StereoCell anew"
    return _finding("packages", not missing, found, cost, is_needed=True)


def _cores() -> Finding:
    cores = (
        len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    )
    return _finding(
        "cores", cores > 1, str(cores), "units are built one after another, not side by side"
    )


def _memory() -> Finding:
    available = _available_bytes()
    if available is None:
        return _finding("memory", True, "not told by this system", "")
    workers = int(available // UNIT_BYTES)
    found = f"{available / _GIB:.1f} GiB available: {workers} workers on tiles of 194 x 512 x 512"
    return _finding("memory", workers >= 1, found, "smaller tiles are needed (--tile-size)")


def _available_bytes() -> int | None:
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
        entries = dict(line.split(":", 1) for line in lines)
        return int(entries["MemAvailable"].split()[0]) * 1024
    except (OSError, KeyError, ValueError):
        pass
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (ValueError, OSError, AttributeError):
        return None


def _disk() -> Finding:
    free = shutil.disk_usage(Path.cwd()).free
    found = f"{free / _GIB:.1f} GiB free in this folder"
    cost = "a large build may not fit: some 1 GB for each tile of 194 x 512 x 512 and channel"
    return _finding("disk", free >= _LEAST_FREE, found, cost)


def _temporary() -> Finding:
    try:
        with tempfile.TemporaryDirectory(prefix="stereocell-"):
            pass
    except OSError as error:
        return _finding(
            "temporary folder", False, str(error), "reports and JPEG in DICOM fail: set TMPDIR"
        )
    return _finding("temporary folder", True, "can be written", "")


def _opengl() -> Finding:
    from stereocell.report.scene import can_draw

    refusal = can_draw()
    cost = "reports have slices and curves, but no pictures of meshes"
    return _finding("OpenGL", not refusal, refusal or "draws off screen", cost)


def _viewer() -> Finding:
    folder = viewer_dist()
    cost = "bundles get no page of their own: `make setup` builds it (Node 20.19), wheels bring it"
    return _finding("viewer", folder is not None, "built" if folder else "not built", cost)


def _browser() -> Finding:
    named = os.environ.get("BROWSER") or os.environ.get("CHROMIUM")
    found = named or next((name for name in _BROWSERS if shutil.which(name)), "")
    cost = "`stereocell view` opens no window here: open its address on another machine (--lan)"
    return _finding("browser", bool(found), found or "none on the PATH", cost)


def _node() -> Finding:
    found = shutil.which("node")
    cost = "`stereocell check` can't run the validators of glTF and KTX2; viewing needs none"
    return _finding("Node.js", found is not None, found or "none on the PATH", cost)


def _gpu() -> Finding:
    devices = sorted(str(path) for path in Path("/dev").glob("dri/render*"))
    devices += sorted(str(path) for path in Path("/dev").glob("nvidia[0-9]*"))
    found = ", ".join(devices) or "none seen"
    cost = "nothing in building; a browser on this machine draws in software, slowly"
    return _finding("GPU", bool(devices), found, cost)


def _extra(name: str, module: str, cost: str) -> Callable[[], Finding]:
    def look() -> Finding:
        there = find_spec(module) is not None
        return _finding(name, there, "installed" if there else "not installed", cost)

    return look


def _finding(name: str, ok: bool, found: str, cost: str, is_needed: bool = False) -> Finding:
    return Finding(name, ok, found, "" if ok else cost, is_needed)


LOOKS: tuple[Callable[[], Finding], ...] = (
    _python,
    _packages,
    _cores,
    _memory,
    _disk,
    _temporary,
    _opengl,
    _viewer,
    _browser,
    _node,
    _gpu,
    _extra(
        "pymeshlab",
        "pymeshlab",
        "no --wrap alpha-wrap; the default wrap needs none (pip install 'stereocell[alpha-wrap]')",
    ),
    _extra(
        "onnxruntime",
        "onnxruntime",
        "no network of your own for `stereocell tissue --model` (pip install 'stereocell[onnx]')",
    ),
)
