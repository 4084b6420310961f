"""Examine the parts of this machine that StereoCell uses, and what a missing part costs."""

import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, requires, version
from importlib.util import find_spec
from pathlib import Path

from stereocell.storage.assets import viewer_dist
from stereocell.storage.processes import available_bytes, cores

_GIB = 1 << 30
UNIT_BYTES = 3.5 * _GIB  # bytes of memory that a unit of 194 x 512 x 512 voxels may take
_MIN_FREE = 20 * _GIB  # bytes of free disk space below which a large build may not fit
_NODE = "20.19"  # oldest version of Node.js that the validators run with
_BROWSERS = ("chromium", "chromium-browser", "google-chrome", "firefox", "safari", "open")


@dataclass(frozen=True, slots=True)
class Finding:
    """One examined part of this machine.

    found      what was found, such as a version
    cost       what does not work without the part; empty if it is present
    is_needed  whether nothing can be built without the part
    """

    name: str
    ok: bool
    found: str
    cost: str
    is_needed: bool = False


def examine() -> Iterator[Finding]:
    """Yield the findings one after another, and change nothing on this machine."""
    for look in LOOKS:
        try:
            found = look()
            yield from found if isinstance(found, list) else [found]
        except ImportError as error:  # the finding `packages` names what is missing
            name = look.__name__.strip("_")
            yield Finding(name, False, str(error), "can't be examined: install StereoCell again")
        except OSError as error:  # a folder was removed or can't be read
            name = look.__name__.strip("_")
            yield Finding(name, False, error.strerror or str(error), "can't be examined")


def _python() -> Finding:
    found = f"{platform.python_implementation()} {platform.python_version()}"
    ok = sys.version_info >= (3, 11)
    return _finding(
        "Python", ok, found, "nothing works: install Python 3.11 or newer", is_needed=True
    )


def _packages() -> Finding:
    """Check the packages that StereoCell requires, by their metadata and without imports."""
    cost = "commands that need them fail: install StereoCell again"
    try:
        from packaging.requirements import Requirement
    except ImportError:
        names = [line for line in requires("stereocell") or () if "extra ==" not in line]
        lacking = [name for line in names for name in re.findall(r"^[\w.-]+", line) if _lacks(name)]
        return _finding("packages", False, f"missing: {', '.join(lacking)}", cost, True)
    faults, count = [], 0
    for line in requires("stereocell") or ():
        wanted = Requirement(line)
        if wanted.marker is not None and not wanted.marker.evaluate({"extra": ""}):
            continue
        count += 1
        try:
            found = version(wanted.name)
        except PackageNotFoundError:
            faults.append(f"{wanted.name} is missing")
            continue
        if not wanted.specifier.contains(found, prereleases=True):
            faults.append(f"{wanted.name} is {found}, expected {wanted.specifier}")
    return _finding("packages", not faults, "; ".join(faults) or f"all {count}", cost, True)


def _lacks(name: str) -> bool:
    try:
        version(name)
    except PackageNotFoundError:
        return True
    return False


def _cores() -> Finding:
    found = cores()
    return _finding("cores", found > 1, str(found), "units are built one after another")


def _memory() -> Finding:
    available = available_bytes()
    workers = int(available // UNIT_BYTES)
    found = f"{available / _GIB:.1f} GiB available: {workers} workers on tiles of 194 x 512 x 512"
    return _finding("memory", workers >= 1, found, "builds need smaller tiles (--tile-size)")


def _disk() -> Finding:
    free = shutil.disk_usage(Path.cwd()).free
    found = f"{free / _GIB:.1f} GiB free in this folder"
    cost = "a large build may not fit: a channel of a tile of 194 x 512 x 512 takes about 0.2 GB"
    return _finding("disk", free >= _MIN_FREE, found, cost)


def _temporary() -> Finding:
    try:
        with tempfile.TemporaryDirectory(prefix="stereocell-"):
            pass
    except OSError as error:
        return _finding(
            "temporary folder", False, str(error), "reports and DICOM with JPEG fail: set TMPDIR"
        )
    return _finding("temporary folder", True, "writable", "")


def _viewer() -> Finding:
    folder = viewer_dist()
    cost = "bundles have no page: build the viewer by `make setup`, or install a wheel"
    return _finding("viewer", folder is not None, "built" if folder else "not built", cost)


def _browser() -> Finding:
    named = os.environ.get("BROWSER") or os.environ.get("CHROMIUM") or ""
    # BROWSER is a list of commands, which may have arguments.
    names = [one.split()[0] for one in named.split(os.pathsep) if one.strip()] or _BROWSERS
    found = next((name for name in names if shutil.which(name)), "")
    lacking = f"BROWSER is {named}, which does not exist" if named else "not on the PATH"
    cost = "`stereocell view` opens no window: open its address on another machine (--lan)"
    return _finding("browser", bool(found), found or lacking, cost)


def _node() -> Finding:
    from packaging.version import InvalidVersion, Version

    path = shutil.which("node")
    cost = "`stereocell check` can't run the validators of glTF and KTX2"
    if path is None:
        return _finding("Node.js", False, "not on the PATH", cost)
    try:
        answer = subprocess.run(
            [path, "--version"], capture_output=True, encoding="utf-8", timeout=20
        )
        there = Version(answer.stdout.strip())
    except (subprocess.TimeoutExpired, InvalidVersion):
        return _finding("Node.js", False, f"{path} does not print its version", cost)
    is_new = there >= Version(_NODE)
    found = f"{there} at {path}" + ("" if is_new else f", expected {_NODE} or newer")
    return _finding("Node.js", is_new, found, cost)


def _gpu() -> Finding:
    devices = sorted(str(path) for path in Path("/dev").glob("dri/render*"))
    devices += sorted(str(path) for path in Path("/dev").glob("nvidia[0-9]*"))
    found = ", ".join(devices) or "none found"
    cost = "builds do not need it, but a browser on this machine draws slowly"
    return _finding("GPU", bool(devices), found, cost)


def _formats() -> list[Finding]:
    """Check the optional libraries of file formats."""
    from stereocell.read.known_formats import known_formats

    rows = known_formats().values()
    libraries = [one for row in rows for one in (row.library, row.decoders) if one is not None]
    return [_extra(one.extra, f"to read {one.reads}", one.import_name)() for one in libraries]


def _extra(name: str, work: str, *modules: str) -> Callable[[], Finding]:
    """Return the check of one of StereoCell's extras.

    work     what needs the extra, for a sentence
    modules  names of the modules that the extra installs
    """

    def look() -> Finding:
        missing = [module for module in modules if find_spec(module) is None]
        found = f"{', '.join(missing)} not installed" if missing else "installed"
        cost = f"optional, needed {work} (pip install 'stereocell[{name}]')"
        return _finding(f"extra {name}", not missing, found, cost)

    return look


def _finding(name: str, ok: bool, found: str, cost: str, is_needed: bool = False) -> Finding:
    return Finding(name, ok, found, "" if ok else cost, is_needed)


LOOKS: tuple[Callable[[], Finding | list[Finding]], ...] = (
    _python,
    _packages,
    _cores,
    _memory,
    _disk,
    _temporary,
    _viewer,
    _browser,
    _node,
    _gpu,
    _formats,
    _extra("alpha-wrap", "for `--wrap alpha-wrap`", "pymeshlab"),
    _extra("draco", "to export .precomputed, and .glb with Draco", "DracoPy"),
    _extra("maps", "for UVs and baked maps (`--maps`)", "xatlas", "alktx2"),
    _extra("notebook", "for `stereocell.show` in notebooks", "anywidget", "IPython", "traitlets"),
    _extra("onnx", "for `stereocell tissue --model`", "onnxruntime"),
    _extra("tables", "to read tables in Parquet", "pyarrow"),
    _extra("video", "to export .mp4 and .webm", "imageio_ffmpeg"),
)
