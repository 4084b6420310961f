"""Resolve the requirements for each system and Python, by wheels alone: `make platforms`.

It writes the table between the markers of docs/systems.md. A cell resolves if the versions that pip
would choose all have wheels. An older version with a wheel does not count, because pip would
compile the newer one. The command asks the package registry, and takes five minutes.
"""

import re
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import date
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "systems.md"
BEGIN, END = "<!-- made by `make platforms` -->", "<!-- end of what it made -->"
CORE = "StereoCell itself"
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
# uv's names of each system, from the oldest C library to newer ones that some extras need
SYSTEMS = {
    "Linux x86-64": ("x86_64-manylinux_2_28", "x86_64-manylinux_2_35"),
    "Linux aarch64": ("aarch64-manylinux_2_28", "aarch64-manylinux_2_35"),
    "macOS arm64": ("aarch64-apple-darwin",),
    "macOS x86-64": ("x86_64-apple-darwin",),
    "Windows x86-64": ("x86_64-pc-windows-msvc",),
}
_JOBS = 4  # parallel resolutions, which mostly wait for the registry


@dataclass(frozen=True, slots=True)
class Found:
    """The result for one row of the table (the core, or an extra) on one system with one Python.

    lacking  the package that has no wheel; empty if all packages have one
    newer    whether the packages need glibc 2.35
    """

    lacking: str
    newer: bool = False


def rows() -> dict[str, list[str]]:
    """Return the requirements of the core and of each extra, as pyproject.toml has them."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    return {CORE: project["dependencies"], **project["optional-dependencies"]}


def resolve(lines: Iterable[str], system: str, python: str, *flags: str) -> tuple[set[str], str]:
    """Return the pinned versions; if they don't resolve, an empty set and uv's message."""
    done = subprocess.run(
        [
            str(Path(sys.executable).with_name("uv")), "pip", "compile", "-", "--quiet",
            "--no-header", "--no-annotate", "--prerelease", "disallow", "--no-python-downloads",
            "--python-platform", system, "--python-version", python, *flags,
        ],
        input="\n".join(lines), capture_output=True, encoding="utf-8",
    )  # fmt: skip
    pins = set(done.stdout.splitlines()) if done.returncode == 0 else set()
    return pins, done.stderr if done.returncode else ""


def blamed(words: str) -> str:
    """Return the package that uv's message names first as the reason; "?" if it names none."""
    begin = r"Because (?:only )?(?:the following versions of )?"
    found = re.search(rf"{begin}([A-Za-z0-9._-]+)", " ".join(words.split()))
    return found[1] if found else "?"


def find(lines: Iterable[str], systems: Iterable[str], python: str) -> Found:
    """Return the result for requirements on a system, with the oldest C library that works."""
    lacking = ""
    for place, system in enumerate(systems):
        wheels, words = resolve(lines, system, python, "--only-binary", ":all:")
        taken, other = resolve(lines, system, python)
        if wheels and taken == wheels:
            return Found("", newer=place > 0)
        built = sorted(line.partition("=")[0] for line in taken - wheels)
        lacking = lacking or (blamed(words or other) if words or other else built[0])
    return Found(lacking)


def cell(found: Mapping[str, Found]) -> str:
    """Return a cell of the table: the versions of Python that resolve, and the lacking packages."""
    good = [python for python in PYTHONS if not found[python].lacking]
    lacking = sorted({one.lacking for one in found.values() if one.lacking})
    versions = f"{spans(good)}" if good else "no"
    if any(one.newer for one in found.values()):
        versions += ", glibc 2.35"
    return f"{versions} ({', '.join(lacking)})" if lacking else versions


def spans(pythons: Iterable[str]) -> str:
    """Return versions of Python in words; consecutive ones are a range.

    >>> spans(["3.11", "3.12", "3.14"])
    '3.11 to 3.12, 3.14'
    """
    parts: list[list[str]] = []
    for python in pythons:
        if parts and PYTHONS.index(parts[-1][-1]) + 1 == PYTHONS.index(python):
            parts[-1].append(python)
        else:
            parts.append([python])
    return ", ".join(part[0] if len(part) == 1 else f"{part[0]} to {part[-1]}" for part in parts)


def table(found: Mapping[tuple[str, str, str], Found], day: date) -> str:
    """Return the text between the markers; keys of `found` are row, system and Python."""
    return "\n".join([BEGIN, "", *_lines(found, day), "", END])


def _lines(found: Mapping[tuple[str, str, str], Found], day: date) -> Iterator[str]:
    asked = rows()
    core = [found[CORE, system, python] for system in SYSTEMS for python in PYTHONS]
    good = sum(not one.lacking for one in core)
    yield f"{good} of {len(core)} pairs of a system and a Python resolve, on {day.isoformat()}."
    yield ""
    yield f"| | {' | '.join(SYSTEMS)} |"
    yield f"|---|{'---|' * len(SYSTEMS)}"
    for row in asked:
        cells = [cell({p: found[row, system, p] for p in PYTHONS}) for system in SYSTEMS]
        yield f"| {row if row == CORE else f'`{row}`'} | {' | '.join(cells)} |"
    yield ""
    yield "The requirements that were resolved:"
    yield ""
    yield "| of | requirements |"
    yield "|---|---|"
    for row, lines in asked.items():
        yield f"| {row} | {', '.join(f'`{line}`' for line in lines)} |"


def main() -> None:
    """Resolve all, print the table and write it into the page."""
    asked = rows()
    keys = [(row, system, python) for row in asked for system in SYSTEMS for python in PYTHONS]

    def look(key: tuple[str, str, str]) -> Found:
        row, system, python = key
        lines = asked[CORE] if row == CORE else [*asked[CORE], *asked[row]]
        return find(lines, SYSTEMS[system], python)

    with ThreadPoolExecutor(_JOBS) as pool:
        found = dict(zip(keys, pool.map(look, keys), strict=True))
    made = table(found, date.today())
    print(made)
    page = PAGE.read_text("utf-8")
    before, after = page.split(BEGIN)[0], page.split(END)[1]
    PAGE.write_text(before + made + after, "utf-8")


if __name__ == "__main__":
    main()
