"""Print disk space by requirement: its own, and with packages that only it brings.

Megabytes (10^6 bytes) of the files that the packages of this environment list, without bytecode.
"""

import re
import tomllib
from importlib.metadata import distributions
from pathlib import Path

from packaging.requirements import Requirement

PYPROJECT = Path(__file__).parents[2] / "pyproject.toml"


def canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


SIZE: dict[str, int] = {}
NEEDS: dict[str, list[Requirement]] = {}
for found in distributions():
    key = canonical(found.metadata["Name"])
    files = [Path(str(found.locate_file(file))) for file in found.files or []]
    SIZE[key] = sum(f.stat().st_size for f in files if f.suffix != ".pyc" and f.is_file())
    NEEDS[key] = [Requirement(line) for line in found.requires or []]


def closure(asked: list[Requirement]) -> set[str]:
    """Return the installed packages of requirements and of all that these require."""
    seen: set[tuple[str, str]] = set()
    waiting = [(canonical(one.name), extra) for one in asked for extra in {"", *one.extras}]
    while waiting:
        name, extra = waiting.pop()
        if name not in SIZE or (name, extra) in seen:
            continue
        seen.add((name, extra))
        for one in NEEDS[name]:
            if one.marker is None or one.marker.evaluate({"extra": extra}):
                waiting += [(canonical(one.name), more) for more in {"", *one.extras}]
    return {name for name, _ in seen}


def megabytes(names: set[str]) -> float:
    return sum(SIZE[name] for name in names) / 1e6


def main() -> None:
    project = tomllib.loads(PYPROJECT.read_text("utf-8"))["project"]
    asked = [Requirement(line) for line in project["dependencies"]]
    whole = closure(asked)
    print(f"in all {megabytes(whole):.0f} MB, {len(whole)} packages")
    print(f"{'requirement':26} {'itself':>7} {'alone brings':>13}  (MB)")
    rows = []
    for one in asked:
        rest = closure([other for other in asked if other is not one])
        rows.append((megabytes(whole - rest), megabytes({canonical(one.name)}), one.name))
    for alone, itself, name in sorted(rows, reverse=True):
        if max(alone, itself) >= 5:
            print(f"{name:26} {itself:7.0f} {alone:13.0f}")
    for extra, lines in project["optional-dependencies"].items():
        more = closure([*asked, *map(Requirement, lines)]) - whole
        print(f"[{extra}]".ljust(26), f"{megabytes(more):7.0f}")


if __name__ == "__main__":
    main()
