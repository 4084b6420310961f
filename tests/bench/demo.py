"""Time `make demo` in a fresh clone of this checkout's last commit, step by step.

    python demo.py FOLDER

FOLDER is replaced by the clone. Steps that run side by side overlap, so the table has the second at
which the result of each step was there. Packages come from the caches of pip and npm.
"""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

from machine import Spent, stated, timed, typical

RESULTS = {
    "packages for Python": ".venv/.ready",
    "packages for the viewer": "viewer_gltf/node_modules/.ready",
    "the viewer's page": "viewer_gltf/dist/index.html",
    "the sample": "out/samples/cycif.ome.zarr",
    "compiled kernels": ".venv/.kernels",
    "plan": "out/demo/plan.json",
    "units": "out/demo/units/done.json",
    "stage": "out/demo/stage/stage.usda",
    "bundle": "out/demo/bundle/manifest.json",
    "report": "out/demo/report/index.html",
}
# A clone must not inherit these settings of this checkout.
OWN = (
    "PYTHONPATH",
    "PYTHONDONTWRITEBYTECODE",
    "STEREOCELL_DATA",
    "MAKEFLAGS",
    "MAKELEVEL",
    "OUT",
    "SAMPLE",
    "WORKERS",
    "ARGS",
)


def run(clone: Path) -> Spent:
    """Run `make demo` in the clone; return its time. Exits with its log if it fails."""
    own = {name: value for name, value in os.environ.items() if name not in OWN}
    with timed() as spent:
        done = subprocess.run(
            ["make", "demo"],
            cwd=clone, env=own, text=True, check=False,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
    if done.returncode:
        sys.exit(done.stdout)
    return typical(spent)


def main(clone: Path) -> None:
    here = Path(__file__).parents[2]
    shutil.rmtree(clone, ignore_errors=True)
    subprocess.run(["git", "clone", "--quiet", str(here), str(clone)], check=True)
    start = time.time()
    spent = run(clone)
    for name, file in sorted(RESULTS.items(), key=lambda item: (clone / item[1]).stat().st_mtime):
        print(f"{name:24} after {(clone / file).stat().st_mtime - start:6.1f} s")
    print(f"{'all, with the check':24} after {spent.seconds:6.1f} s\n{spent}")
    packages = sum(one.lstat().st_size for one in (clone / ".venv").rglob("*") if one.is_file())
    print(f"packages of a user take {packages / 1e9:.2f} GB")


if __name__ == "__main__":
    with stated():
        main(Path(sys.argv[1]))
