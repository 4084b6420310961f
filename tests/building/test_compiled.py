"""Builds compile no kernel again: they call kernels with the types that set-up compiled."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from support import phantoms
from support.touching_cells import touching_cells

# in a process of its own, because other tests call kernels with other types
BUILDS = """
import gc
import sys

from numba.core.registry import CPUDispatcher

from stereocell.cli.__main__ import main
from stereocell.kernels.compile_all import compile_of_meshes, compile_others

compile_of_meshes()
compile_others()
compiled = [each for each in gc.get_objects() if isinstance(each, CPUDispatcher)]
kernels = {each.__name__: each for each in compiled if each.__module__.startswith("stereocell.")}
before = {name: set(kernel.signatures) for name, kernel in kernels.items()}
for source, out, *labels in (sys.argv[1:3], [*sys.argv[3:5], "--labels", "."]):
    assert main(["build", source, "--out", out, "--workers", "0", "--grid", "2x1", *labels]) == 0
for name, kernel in kernels.items():
    for signature in set(kernel.signatures) - before[name]:
        print("compiled:", name, signature)
print(len(kernels), "kernels")
"""


@pytest.mark.slow
def test_builds_call_kernels_as_they_were_compiled(tmp_path: Path) -> None:
    image, mask = tmp_path / "f.ome.tif", tmp_path / "mask.ome.tif"
    body = phantoms.f_phantom()
    phantoms.write_ome_tiff(image, np.concatenate([body, body], axis=2)[None], "CZYX", names=["F"])
    labels, _ = touching_cells((24, 48, 96), (1.0, 0.5, 0.5))
    phantoms.write_ome_tiff(mask, labels.astype(np.uint16)[None], "CZYX", names=["cells"])
    names = [image, tmp_path / "image", mask, tmp_path / "cells"]
    done = subprocess.run(
        [sys.executable, "-c", BUILDS, *map(str, names)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert "compiled:" not in done.stdout, done.stdout
    assert int(done.stdout.split()[-2]) > 40
