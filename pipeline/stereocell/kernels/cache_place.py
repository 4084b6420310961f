"""Find the cache of compiled kernels, and whether all kernels are in it, without importing numba.

The cache is the first of these folders that can be written: the folder named by NUMBA_CACHE_DIR,
`__pycache__` beside the kernels, or the user's cache. It holds one folder for each module. The
folder's name is a hash of the module and of the kernels that it imports, because numba does not
notice that a called function in another file has changed.
"""

import hashlib
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path

_HERE = Path(__file__).parent
_PREFIX = "kernels-"
_IMPORT = re.compile(r"^from stereocell\.kernels\.(\w+) import", re.MULTILINE)


@cache
def find_home() -> Path | None:
    """Return the folder of the cache, or None if no folder can be written.

    Without this folder, each process compiles the kernels that it needs.
    """
    named = os.environ.get("NUMBA_CACHE_DIR")
    for home in [Path(named)] if named else [_HERE / "__pycache__", _user_cache()]:
        with suppress(OSError, RuntimeError):
            home.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=home):
                return home
    return None


@cache
def cache_folder(module: str) -> Path | None:
    """Return the folder of a module's compiled kernels, or None if there is no cache."""
    home, name = find_home(), module.rpartition(".")[2]
    return home and home / f"{_PREFIX}{name}-{_digest(_reach(name))}"


def are_compiled() -> bool:
    """Return whether all kernels are compiled on this machine, or there is no cache for them."""
    mark = _mark()
    return mark is None or mark.exists()


def compile_in_process() -> None:
    """Compile all kernels in another process. If one fails, its next use raises the error."""
    subprocess.run([sys.executable, "-m", __package__], check=False, capture_output=True)


def mark_compiled() -> None:
    """Record that all kernels are compiled, and remove compiled kernels of older versions."""
    home, mark = find_home(), _mark()
    if home is None or mark is None:
        return
    with suppress(OSError):
        mark.touch()
    own = {mark, *(cache_folder(file.stem) for file in _HERE.glob("*.py"))}
    for old in home.glob(f"{_PREFIX}*"):
        if old.is_dir() and old not in own:
            shutil.rmtree(old, ignore_errors=True)


def _mark() -> Path | None:
    home = find_home()
    every = {file.stem for file in _HERE.glob("*.py")}
    return home and home / f"{_PREFIX}{_digest(every, sys.version, _processor())}.done"


def _digest(modules: set[str], *more: str) -> str:
    digest = hashlib.sha256(" ".join((version("numba"), *more)).encode())
    for name in sorted(modules):
        digest.update((_HERE / f"{name}.py").read_bytes())
    return digest.hexdigest()[:12]


def _reach(name: str) -> set[str]:
    """Return the module and all modules of this package that it imports."""
    found, waiting = set[str](), [name]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += _IMPORT.findall((_HERE / f"{name}.py").read_text("utf-8"))
    return found


def _processor() -> str:
    """Return the processor's features: numba compiles again for other features."""
    with suppress(OSError):
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
        return next((line for line in lines if line.startswith(("flags", "Features"))), "")
    return platform.machine()


def _user_cache() -> Path:
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home()) / "stereocell"
    if sys.platform == "darwin":
        return Path.home() / "Library/Caches/stereocell"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "stereocell"
