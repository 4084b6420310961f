"""Measure each phase of the builds of a sample tile and of real volumes, by one worker and by two.

    python builds.py FOLDER [--only NAME] [--workers 1,2] [--baseline CHECKOUT] [--publish]

With a baseline, another checkout of this repository, each build is made by its code first and by
this one directly afterwards, with the same packages. Then each row also has the baseline's figures,
and how many times as fast this checkout is. Without a baseline it takes a quarter of an hour. Real
volumes are those of STEREOCELL_DATA; one that is missing is skipped. The builds stay in FOLDER. The
bench fails if another number of workers gives other bytes.
"""

import argparse
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from commands import STEREOCELL, make_sample
from machine import range_of, stated
from phases import (
    AT_ONCE,
    COLUMNS,
    Cost,
    build_at_once,
    environment_of,
    rows_of,
    run_phases,
    totals,
)
from published import publish

from support.digests import digests_of_build

DATA = Path(os.environ.get("STEREOCELL_DATA", "../shared/data")).resolve()
TILE = (194, 512, 512)
# Names, files below DATA, and the flags of their plans
REAL = {
    "brain cells": ("brain_cells_2ch/brain_cells_2ch.ome.tif", ["--preset", "lightsheet"]),
    "head, CT": ("ct_head_ge", ["--preset", "ct"]),
    "head, MRI at 7 T": ("mri_t1_7t/dicoms", ["--preset", "mri"]),
}
MEASURES = "seconds, CPU, references"
COMPARED = (*COLUMNS, f"before: {MEASURES}", f"times as fast: {MEASURES}")
TITLES = {1: "By one worker", 2: "By two workers"}  # of the published tables


@dataclass(frozen=True)
class Built:
    """Costs of the phases of one input; `before` has those of the baseline, if there is one.

    digests  hashes of the files that this checkout wrote
    """

    name: str
    costs: dict[str, Cost]
    before: dict[str, Cost]
    digests: dict[str, str]


def inputs(folder: Path, tile: tuple[int, int, int], only: str) -> Iterator[tuple[str, list[str]]]:
    """Yield the names and arguments of plans."""
    name = f"sample tile of {' x '.join(map(str, tile))}, three channels"
    if name.startswith(only):
        source = make_sample(folder, (1, 1), tile)
        flags = ["--preset", "cycif", "--level", "0", "--grid", "1x1"]
        yield name, [str(source), *flags]
    for name, (file, flags) in REAL.items():
        if not name.startswith(only):
            continue
        if (DATA / file).exists():
            yield name, [str(DATA / file), *flags]
        else:
            print(f"{name}: skipped: no {file} below {DATA} (STEREOCELL_DATA)")


def measure(folder: Path, name: str, plan: list[str], workers: int, baseline: Path | None) -> Built:
    """Build one input, by the baseline first."""
    found: list[dict[str, Cost]] = []
    for checkout in ([baseline] if baseline else []) + [None]:
        print(f"{name}, {workers} workers, {checkout or 'this checkout'}", flush=True)
        out = folder / ("before" if checkout else "now")
        for left in (out, folder / "at-once"):  # a build that was stopped would go on there
            shutil.rmtree(left, ignore_errors=True)
        how = ["--workers", str(workers)]
        costs = run_phases(out, plan, how, (), checkout)
        costs[AT_ONCE] = build_at_once(folder / "at-once", plan, how, checkout)
        found.append(costs)
        shutil.rmtree(folder / "at-once")
    return Built(name, found[-1], found[0] if baseline else {}, digests_of_build(out))


def compared_rows(built: Built) -> list[list[str]]:
    """Return the rows of one input: its name, its phases, and the sums of them."""
    width = len(COMPARED if built.before else COLUMNS)
    title = [f"**{built.name}**", *[""] * (width - 1)]
    rows = rows_of(built.costs)
    if built.before:
        before, now = (costs | totals(costs) for costs in (built.before, built.costs))
        for row in rows:
            old, new = before[row[0]], now[row[0]]
            row.append(f"{old.seconds:.1f}; {old.cpu:.1f}; {old.references:,.0f}")
            ratios = (
                old.seconds / new.seconds,
                old.cpu / new.cpu,
                old.references / new.references,
            )
            row.append("; ".join(f"{ratio:.2f}" for ratio in ratios))
    return [title, *rows]


def compile_kernels(checkout: Path | None) -> None:
    """Fill the cache of compiled kernels, so that no build waits for it."""
    command = [*STEREOCELL[:-1], "stereocell.kernels"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=environment_of(checkout))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="the folder of the sample tile and of the builds")
    parser.add_argument("--only", default="", help="inputs whose name begins so")
    parser.add_argument("--tile", default=",".join(map(str, TILE)), help="z,y,x of the sample tile")
    parser.add_argument("--workers", default="1,2", help="numbers of workers")
    parser.add_argument("--baseline", type=Path, help="another checkout, to compare with")
    parser.add_argument("--publish", action="store_true", help="put the tables into the docs")
    given = parser.parse_args()
    if given.publish and given.only:
        parser.error(
            "--publish replaces the rows of all inputs, so it can't be combined with --only"
        )
    given.folder.mkdir(parents=True, exist_ok=True)
    z, y, x = map(int, given.tile.split(","))
    for checkout in {given.baseline, None}:
        compile_kernels(checkout)
    builds: dict[int, list[Built]] = {workers: [] for workers in map(int, given.workers.split(","))}
    for name, plan in inputs(given.folder, (z, y, x), given.only):
        for workers, done in builds.items():
            done.append(measure(given.folder, name, plan, workers, given.baseline))
    for workers, done in builds.items():
        rows = [row for built in done for row in compared_rows(built)]
        columns = COMPARED if given.baseline else COLUMNS
        print(f"\n{TITLES.get(workers, f'By {workers} workers')}\n| {' | '.join(columns)} |")
        print("|---" * len(columns) + "|")
        print("\n".join(f"| {' | '.join(row)} |" for row in rows))
        if given.publish and workers in TITLES:
            costs = [
                cost for built in done for cost in (*built.costs.values(), *built.before.values())
            ]
            publish("builds", TITLES[workers], columns, rows, range_of(costs))
    differing = {
        one.name
        for done in builds.values()
        for one, first in zip(done, next(iter(builds.values())), strict=True)
        if one.digests != first.digests
    }
    for name in sorted(differing):
        print(f"{name}: the numbers of workers gave different bytes")
    return 1 if differing else 0


if __name__ == "__main__":
    with stated():
        sys.exit(main())
