"""Measure one unit of 194 x 512 x 512 voxels: dense nuclei, white noise, and a sponge.

    python one_unit.py FOLDER

For each, `stereocell units` runs in a process of its own that measures its CPU seconds and its
memory, with all passes from the display window to the meshes. Noise and a sponge have surfaces only
by a given iso-value. Their CPU time is compared with that of the nuclei. The sources stay in FOLDER
and are made once. All takes four minutes. scale.py runs this bench, too.
"""

import json
import math
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1]))
from commands import call, make_sample, plan
from machine import Spent, load, measure_reference, stated
from phases import environment_of

from support.phantoms import write_ome_zarr

SHAPE = (194, 512, 512)
MAX_BYTES = 1.5e9  # largest peak memory of the process that builds dense nuclei
GOAL_PASSES = 14  # CPU time of dense nuclei, in Gaussian passes over the unit's voxels
GOAL_TIMES = 3  # CPU time of a noisy surface, as a ratio to dense nuclei
LEVEL, SPREAD = 1000, 200  # mean of noise and of the sponge, which is their iso-value; deviation
PERIOD = 5.75  # voxels; period of the sponge, which then has 41 million voxel faces
NOISY = ("white noise", "a sponge")

# Runs in a process of its own, which builds one unit and measures itself meanwhile.
WATCHED = """
import collections, json, sys, threading, time
from stereocell.cli.__main__ import main

def rss():
    return int(open("/proc/self/statm").read().split()[1]) * 4096

most, before, is_over = collections.defaultdict(int), rss(), False
me = threading.main_thread().ident
def watch():
    while not is_over:
        frame, place = sys._current_frames().get(me), "?"
        while frame is not None:
            name = frame.f_globals.get("__name__", "")
            if name.startswith("stereocell."):
                place = f"{name.removeprefix('stereocell.')}.{frame.f_code.co_name}"
                break
            frame = frame.f_back
        most[place] = max(most[place], rss())
        time.sleep(0.02)
thread = threading.Thread(target=watch)
thread.start()
start, busy = time.perf_counter(), time.process_time()
code = main(sys.argv[1:])
seconds, cpu = time.perf_counter() - start, time.process_time() - busy
is_over = True
thread.join()
status = open("/proc/self/status").read()  # what code that lets no thread look took as well
peak = int(status.split("VmHWM:")[1].split()[0]) * 1024
places = {"(the process)": peak, "(interpreter and libraries)": before, **most}
print(json.dumps({"seconds": seconds, "cpu": cpu, "places": places}))
"""


@dataclass
class Unit(Spent):
    """Cost of one unit; `places` has the peak memory, bytes, while each function ran."""

    places: dict[str, int] = field(default_factory=dict)

    @property
    def peak(self) -> int:
        return max(self.places.values())


def watch_unit(out: Path) -> Unit:
    """Build OUT's one unit in a process that measures itself."""
    before = measure_reference()
    answer = subprocess.run(
        [sys.executable, "-c", WATCHED, "units", str(out), "--workers", "0"],
        capture_output=True, text=True, check=True, env=environment_of(None),
    )  # fmt: skip
    reference = (before + measure_reference()) / 2
    return Unit(**json.loads(answer.stdout.splitlines()[-1]), reference=reference, load=load())


def noisy_voxels(name: str, shape: tuple[int, int, int]) -> NDArray[np.uint16]:
    """Return white noise or a sponge (a gyroid), uint16 (z, y, x)."""
    if name == "white noise":
        values = np.random.default_rng(1).normal(LEVEL, SPREAD, shape)
    else:
        z, y, x = np.ogrid[tuple(slice(n) for n in shape)]
        u, v, w = (2 * math.pi / PERIOD * axis for axis in (z, y, x))
        gyroid = np.sin(u) * np.cos(v) + np.sin(v) * np.cos(w) + np.sin(w) * np.cos(u)
        values = LEVEL + SPREAD * gyroid
    return np.clip(values, 0, 4000).astype(np.uint16)


def plan_noisy(folder: Path, name: str, shape: tuple[int, int, int], out: Path) -> None:
    source = folder / f"{name.replace(' ', '_')}_{'_'.join(map(str, shape))}.ome.zarr"
    if not source.exists():
        half = folder / "half.ome.zarr"
        channels = [{"label": "noisy"}]
        voxels = noisy_voxels(name, shape)[None]
        write_ome_zarr(half, [voxels], "czyx", chunks=(1, 97, 128, 128), channels=channels)
        half.rename(source)
    size = ",".join(map(str, shape))
    call("plan", str(source), "-o", str(out), "--level", "0", "--tile-size", size,
         "--iso-value", f"noisy={LEVEL}", "--force")  # fmt: skip


def measure_dense(folder: Path, shape: tuple[int, int, int] = SHAPE) -> Unit:
    """Build the nuclei of the sample tile, and print the cost."""
    source, out = make_sample(folder, (1, 1), shape), folder / "real"
    plan(str(source), out, (1, 1), shape, "0")
    dense = watch_unit(out)
    passes = dense.passes(shape)
    print(f"A unit of {' x '.join(map(str, shape))}, dense nuclei")
    print(f"  {dense}")
    print(f"  {passes:.1f} Gaussian passes over its voxels (goal {GOAL_PASSES}: "
          f"{'reached' if passes <= GOAL_PASSES else 'missed'})")  # fmt: skip
    print(f"  most memory while this ran, GB (bound {MAX_BYTES / 1e9:g}):")
    for place, most in sorted(dense.places.items(), key=lambda item: -item[1])[:8]:
        print(f"    {most / 1e9:5.2f}  {place}")
    return dense


def measure_noisy(
    folder: Path, dense: Unit, shape: tuple[int, int, int] = SHAPE
) -> dict[str, Unit]:
    """Build noise and a sponge, print their cost beside that of dense nuclei, and return it."""
    found = {}
    for name in NOISY:
        out = folder / "noisy"
        plan_noisy(folder, name, shape, out)
        unit = found[name] = watch_unit(out)
        times = unit.references / dense.references
        print(f"A unit of {name}\n  {unit}   {unit.peak / 1e9:.2f} GB")
        print(f"  {times:.1f} x the CPU time of dense nuclei (goal {GOAL_TIMES}: "
              f"{'reached' if times <= GOAL_TIMES else 'missed'})", flush=True)  # fmt: skip
    return found


def main(folder: Path) -> int:
    folder.mkdir(parents=True, exist_ok=True)
    dense = measure_dense(folder)
    measure_noisy(folder, dense)
    is_kept = dense.peak <= MAX_BYTES
    print(f"Bound of memory: {'kept' if is_kept else 'NOT KEPT'}")
    return 0 if is_kept else 1


if __name__ == "__main__":
    with stated():
        sys.exit(main(Path(sys.argv[1])))
