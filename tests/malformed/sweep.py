"""Change every format's source by seeds, with `python tests/malformed/sweep.py`, and print a table.

Each source is changed 80 times; `--first` sets the first seed. The same seed makes the same change.
Exit code 1: a changed source was read wrongly without a note, or did not end with one line, and is
not in KNOWN.
"""

import argparse
import os
import shutil
import sys
import tempfile
from collections import Counter
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"  # a process that forks has no threads
sys.path.insert(0, str(Path(__file__).parents[1]))

from malformed.mutation_trial import OUTCOMES, Ended, Intact  # noqa: E402
from malformed.subjects import Subject, all_subjects  # noqa: E402
from malformed.trial import import_package  # noqa: E402

COUNT = 80  # changes of each source; 2800 in total
_BAD = ("wrong", "fault")
# Changes that are read wrongly, by name, each with the reason. None is known. The table counts
# them as wrong.
KNOWN: dict[str, str] = {}


def main() -> int:
    parser = argparse.ArgumentParser(prog="python tests/malformed/sweep.py", description=__doc__)
    parser.add_argument("--count", type=int, default=COUNT, help="changes of each source")
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--only", default="", help="sources whose `format, name` holds this")
    parser.add_argument("--show", default="wrong fault", help="outcomes that are printed each")
    options = parser.parse_args()
    subjects = [s for s in all_subjects() if options.only in f"{s.format}, {s.name}"]
    import_package("stereocell.read")
    seeds = range(options.first, options.first + options.count)
    found: list[Ended] = []
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        for number, subject in enumerate(subjects):
            for ended in trials(subject, seeds, Path(folder) / str(number)):
                found.append(ended)
                if ended.outcome in options.show:
                    print(f"{ended.outcome.upper()} {ended.name}: {ended.words!a:.500}", flush=True)
    print(table_of(found))
    bad = [ended.name for ended in found if ended.outcome in _BAD]
    for name in bad:
        if name in KNOWN:
            print(f"known: {name}: {KNOWN[name]}")
    return 1 if any(name not in KNOWN for name in bad) else 0


def trials(subject: Subject, seeds: range, folder: Path) -> list[Ended]:
    """Change one source by each seed, and return how the trials ended."""
    intact = Intact(subject, folder / "intact")
    found = []
    for seed in seeds:
        place = folder / str(seed)
        place.mkdir()
        found.append(intact.trial(seed, place))
        shutil.rmtree(place)
    return found


def table_of(found: list[Ended]) -> str:
    """Return the counts by format, as a Markdown table."""
    lines = [
        f"| format | changes | {' | '.join(OUTCOMES)} |",
        f"|---|{'---:|' * (len(OUTCOMES) + 1)}",
    ]
    formats = list(dict.fromkeys(ended.subject.format for ended in found))
    for one in [*formats, "all"]:
        some = Counter(ended.outcome for ended in found if one in (ended.subject.format, "all"))
        counts = " | ".join(str(some[outcome]) for outcome in OUTCOMES)
        lines.append(f"| {one} | {some.total()} | {counts} |")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
