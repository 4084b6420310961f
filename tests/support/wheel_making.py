"""Build wheels and sdists of a checkout, and copy its compiled kernels to an installation."""

import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def build_package(kind: str, checkout: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """Build a `wheel` or an `sdist` of the checkout into the folder, with an empty PATH."""
    command = [sys.executable, "-m", "hatchling", "build", "-t", kind, "-d", str(folder)]
    ours = ("PYTHONPATH", "VIRTUAL_ENV", "PYTHONHOME")
    environment = {name: value for name, value in os.environ.items() if name not in ours}
    return subprocess.run(
        command,
        cwd=checkout,
        env={**environment, "PATH": ""},
        capture_output=True,
        text=True,
        check=False,
    )


def take_compiled(kernels: Path, cache: Path) -> None:
    """Copy the checkout's compiled kernels to the cache of another installation.

    Compiling takes half a minute. numba finds kernels by the folder and the times of the sources,
    so the installed sources get the times of the checkout. numba compiles the kernels that it
    can't find.
    """
    ours = ROOT / "pipeline" / "stereocell" / "kernels"
    name = f"kernels_{hashlib.sha1(str(kernels).encode()).hexdigest()}"
    for source in kernels.glob("*.py"):
        shutil.copystat(ours / source.name, source)
    for folder in (ours / "__pycache__").glob("kernels-*/*"):
        if folder.is_dir():
            shutil.copytree(folder, cache / folder.parent.name / name)
