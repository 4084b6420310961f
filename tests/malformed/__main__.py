"""`python tests/malformed`: run the corpus, print a table by kind and outcome; exit 1 on faults."""

import argparse
import json
import os
import sys
import tempfile
from collections import Counter
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"  # a process that forks has no threads
sys.path.insert(0, str(Path(__file__).parents[1]))

from malformed import trial  # noqa: E402
from malformed.base import BUILD, write_base  # noqa: E402
from malformed.cases import Case  # noqa: E402
from malformed.corpus import all_cases, one_of_each_kind, sample  # noqa: E402


def main() -> int:
    parser = argparse.ArgumentParser(prog="python tests/malformed", description=__doc__)
    parser.add_argument("--jobs", type=int, default=2, help="how many at a time")
    parser.add_argument("--only", default="", help="cases whose `kind: name` holds this")
    parser.add_argument("--sample", type=int, default=0, help="so many, spread evenly")
    parser.add_argument("--each-kind", action="store_true", help="one of each kind")
    parser.add_argument("--json", type=Path, help="write each case's fault there")
    parser.add_argument("--keep", type=Path, help="work in this new folder, and leave it")
    parser.add_argument("--show", action="store_true", help="print how each case ended")
    options = parser.parse_args()
    cases = [c for c in all_cases() if options.only in f"{c.kind}: {c.name}"]
    if options.each_kind:
        cases = one_of_each_kind(cases)
    if options.sample:
        cases = sample(cases, options.sample)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as temporary:
        folder = options.keep or Path(temporary)
        found = run(cases, folder, options)
    print_table(found)
    if options.json:
        options.json.write_text(
            json.dumps({f"{o.case.kind}: {o.case.name}": o.fault for o in found})
        )
    return 1 if any(outcome.fault for outcome in found) else 0


def run(cases: list[Case], folder: Path, options: argparse.Namespace) -> list[trial.Outcome]:
    base, work = folder / "base", folder / "work"
    base.mkdir(parents=True)
    work.mkdir()
    trial.import_all()
    trial.run_in_child(write_base, base)
    trial.run_in_child(build, base)
    found = []
    for outcome in trial.run_cases(cases, base, work, options.jobs, options.keep is not None):
        found.append(outcome)
        if outcome.fault or options.show:
            about = f"{outcome.case.kind}: {outcome.case.name}: exit code {outcome.code}"
            result = f"FAULT {outcome.fault}" if outcome.fault else outcome.line
            print(
                f"{about}, {outcome.seconds:.1f} s, {outcome.peak_mb:.0f} MB: {result!a}",
                flush=True,
            )
    return found


def build(base: Path) -> None:
    """Build v5.zarr, an OME-Zarr 0.5 of two channels, into base/out."""
    os.chdir(base)
    with open(os.devnull, "w") as nowhere, redirect_stdout(nowhere), redirect_stderr(nowhere):
        codes = [trial.run_command(command) for command in BUILD]
    if any(codes):
        raise RuntimeError(f"the build's commands ended with {codes}")


def print_table(found: list[trial.Outcome]) -> None:
    kinds = list(dict.fromkeys(outcome.case.kind for outcome in found))
    print(f"{'kind':12}{'done':>8}{'refused':>9}{'fault':>7}{'all':>7}{'most MB':>9}{'most s':>8}")
    for kind in [*kinds, "all"]:
        some = [o for o in found if kind in (o.case.kind, "all")]
        ways = Counter("fault" if o.fault else "refused" if o.code else "done" for o in some)
        print(
            f"{kind:12}{ways['done']:8}{ways['refused']:9}{ways['fault']:7}{len(some):7}"
            f"{max((o.peak_mb for o in some), default=0):9.0f}"
            f"{max((o.seconds for o in some), default=0):8.1f}"
        )


if __name__ == "__main__":
    sys.exit(main())
