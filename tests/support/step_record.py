"""Compare the code that each step and each reader reaches with the recorded digests.

    PYTHONPATH=tests python -m support.step_record [--write]

A user's finished results stay valid until a step's VERSION, or a reader's `version`, is raised. So
whoever changes code that a step reaches has to decide: do the same inputs still give the same
result? The record, `engine/step_record.json`, says on which code the last decision was made. It
holds the locked versions of the libraries for the same reason.

Code is found from the imports. Comments, docstrings and the layout of lines do not count. NEUTRAL
modules do not count either, because they can't change a byte of a result. They open and write
files, distribute tasks, choose a reader, or refuse a source. They also make plans, whose values
are part of each result's key.
"""

import ast
import hashlib
import importlib
import io
import json
import re
import sys
import tokenize
from collections.abc import Iterable, Iterator, Mapping
from fnmatch import filter as fitting
from functools import cache
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

from packaging.utils import canonicalize_name

import stereocell
from stereocell.engine.step import Keyed, Step
from stereocell.engine.step_record import RECORD
from stereocell.read.known_formats import known_formats
from stereocell.storage.assets import find_asset

PACKAGE = Path(stereocell.__file__).parent
LOCKS = [PACKAGE.parents[1] / f"requirements{of}.lock" for of in ("", "-dev")]
NEUTRAL = (
    "storage",
    "engine",
    "model.errors",
    "model.settings",
    "model.timing",
    "kernels.cache_place",
    "planning.settings",
    "planning.plan",
    "planning.plan_file",
    "building.out_folder",
    "read.format",
    "read.known_formats",
    "read.readers",
    "read.file_kind",
    "read.remarks",
)
# modules of neutral packages that read values
COUNTED = ("stereocell.storage.open_hdf5",)
# import name of a library -> names of libraries that it loads at run time; `*`: any ending
BEHIND = {
    "bioio": ("bioio_*",),
    "pydicom": ("gdcm", "openjpeg", "pylibjpeg"),  # read/formats/dicom/stored_values.py
    "tifffile": ("imagecodecs",),
    "zarr": ("numcodecs",),
}
_STEP = re.compile(r"^class \w+\((?:Step\[|Keyed\))", re.MULTILINE)


def record() -> dict[str, Any]:
    """Return the content that the record should have for the present code.

    steps      of each step and reader, by name: its version, a digest of the code that it reaches,
               and the names of all libraries that its modules import, for provenance
    libraries  the locked versions of the libraries that can change a result
    """
    steps = {step.__name__: _entry(step.__module__, step.VERSION) for step in find_steps()}
    formats = known_formats()
    readers = {name: _entry(one.module, one.version) for name, one in formats.items()}
    entries = {**dict(sorted(steps.items())), **dict(sorted(readers.items()))}
    modules = {step.__module__ for step in find_steps()}
    modules |= {one.module for one in formats.values()}
    used = {library for module in modules for library in reach(module)[1]}
    text = "".join(lock.read_text("utf-8") for lock in LOCKS)
    lines = re.findall(r"^([\w.-]+)(?:\[.*\])?==([^\s;]+)", text, re.M)
    locked = {canonicalize_name(name): version for name, version in lines}
    canonical = {name: canonicalize_name(name) for name in sorted(used, key=str.lower)}
    return {
        "libraries": {name: locked[one] for name, one in canonical.items() if one in locked},
        "steps": entries,
    }


def find_steps() -> list[type[Keyed]]:
    """Return the class of every step."""
    for name, file in _modules().items():
        if _STEP.search(file.read_text("utf-8")):
            importlib.import_module(name)
    # `dataclass(slots=True)` makes a second class of the same name.
    steps = {
        (one.__module__, one.__name__): getattr(sys.modules[one.__module__], one.__name__, None)
        for one in (*Keyed.__subclasses__(), *Step.__subclasses__())
        if one is not Step and one.__module__.startswith(f"{PACKAGE.name}.")
    }
    return sorted(filter(None, steps.values()), key=lambda step: step.__name__)


def compare(found: Mapping[str, Any], recorded: Mapping[str, Any]) -> list[str]:
    """Return a line for each decision that a developer has to make; empty: the record is right."""
    now, then = found["steps"], recorded["steps"]
    lines = []
    if changed := [one for one in now if one in then and now[one]["code"] != then[one]["code"]]:
        lines.append(f"the code of {', '.join(changed)} changed")
    for one in now:
        if one in then and now[one]["version"] < then[one]["version"]:
            raise SystemExit(
                f"{one}: VERSION is {now[one]['version']}, recorded {then[one]['version']}: "
                "results of the later version would count as its own; raise it"
            )
    raised = [one for one in now if one in then and now[one]["version"] > then[one]["version"]]
    if raised:
        lines.append(f"the VERSION of {', '.join(raised)} was raised")
    if others := sorted(now.keys() ^ then.keys()):
        lines.append(f"{', '.join(others)}: new, or gone")
    if odd := [one for one in now if one in then and now[one] != then[one]]:
        libraries = [one for one in odd if now[one]["libraries"] != then[one]["libraries"]]
        lines += [f"{', '.join(libraries)}: other libraries than before"] if libraries else []
    old, new = recorded["libraries"], found["libraries"]
    for name in sorted(old.keys() | new.keys()):
        if old.get(name) != new.get(name):
            users = [step for step, entry in now.items() if name in entry["libraries"].split()]
            lines.append(
                f"{name} is locked at {new.get(name)}, recorded {old.get(name)}: "
                f"{', '.join(users)} use it"
            )
    return lines


@cache
def digest_of(text: str) -> str:
    """Return a digest of a module's code, without comments, docstrings and layout of lines."""
    left_out = {
        line
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)
    }
    lines = text.splitlines()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            line, column = token.start
            lines[line - 1] = lines[line - 1][:column]
    kept = (line.strip() for number, line in enumerate(lines, 1) if number not in left_out)
    return hashlib.sha256(" ".join(filter(None, kept)).encode()).hexdigest()


def reach(module: str, left_out: Iterable[str] = NEUTRAL) -> tuple[list[Path], list[str]]:
    """Return our files that a module needs, with its own file, and the names of its libraries."""
    files: set[Path] = set()
    foreign: set[str] = set()
    seen, waiting = {PACKAGE.name}, [module]
    while waiting:
        name = waiting.pop()
        if name in seen:
            continue
        seen.add(name)
        top = name.partition(".")[0]
        if top != PACKAGE.name:
            foreign.add(top)
            continue
        file = _modules().get(name)  # None for the name of something inside a module
        parts = (f"{PACKAGE.name}.{part}" for part in left_out)
        is_neutral = any(f"{name}.".startswith(f"{part}.") for part in parts)
        if file is None or (is_neutral and name not in COUNTED):
            continue
        assets, imports = _needs(file)
        files |= {file, *assets}
        waiting += imports
    libraries = {one for top in foreign - sys.stdlib_module_names for one in _libraries(top)}
    return sorted(files), sorted(libraries)


def main(arguments: list[str]) -> None:
    """Compare the code with the record, or write the record again."""
    found = record()
    if arguments == ["--write"]:
        RECORD.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
        return
    lines = compare(found, json.loads(RECORD.read_bytes())) if RECORD.is_file() else ["no record"]
    if lines:
        raise SystemExit(
            "\n".join(lines) + "\nWhere the same inputs give another result, raise the step's "
            "VERSION (a format's `version` in its row). Then, or where results are the "
            "same, run `make record-steps`."
        )


def _entry(module: str, version: int) -> dict[str, Any]:
    digest = hashlib.sha256(module.encode())
    for file in reach(module)[0]:
        content = file.read_bytes()
        is_code = file.suffix == ".py"
        digest.update(digest_of(content.decode()).encode() if is_code else content)
    libraries = " ".join(reach(module, left_out=())[1])
    return {"version": version, "code": digest.hexdigest()[:16], "libraries": libraries}


@cache
def _needs(file: Path) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    """Return the shipped files and the modules that a file of ours names."""
    tree = ast.parse(file.read_bytes())
    return tuple(_assets(tree)), tuple(_imports(tree))


def _assets(tree: ast.Module) -> Iterator[Path]:
    """Yield the shipped files that a module finds by a literal name."""
    for node in ast.walk(tree):
        match node:
            case ast.Call(func=ast.Name(id=name), args=[ast.Constant(value=str(path))]) if (
                name == find_asset.__name__
            ):
                asset = find_asset(path)
                yield from asset.rglob("*.*") if asset.is_dir() else [asset]


def _imports(tree: ast.Module) -> Iterator[str]:
    """Yield the dotted names of all imports, also of those in functions."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _libraries(top: str) -> Iterator[str]:
    """Yield the packages with an import name, and the packages that these load at run time."""
    known = _distributions()
    behind = (fitting(known, pattern) or [pattern] for pattern in BEHIND.get(top, ()))
    for name in (top, *(one for names in behind for one in names)):
        yield from known.get(name, (name,))


@cache
def _modules() -> Mapping[str, Path]:
    """Return the files of our modules by their dotted names."""
    names = {
        file: file.relative_to(PACKAGE).with_suffix("").parts for file in PACKAGE.rglob("*.py")
    }
    return {
        ".".join((PACKAGE.name, *parts)).removesuffix(".__init__"): file
        for file, parts in names.items()
    }


@cache
def _distributions() -> Mapping[str, list[str]]:
    """Return the names of the installed packages by the names under which they are imported.

    importlib.metadata.packages_distributions() misses a package that is one extension module.
    """
    found: dict[str, list[str]] = {}
    for package in distributions():
        tops = (package.read_text("top_level.txt") or "").split() or {
            line.partition(",")[0].partition("/")[0].partition(".")[0]
            for line in (package.read_text("RECORD") or "").splitlines()
        }
        for top in tops:
            found.setdefault(top, []).append(package.metadata["Name"])
    return found


if __name__ == "__main__":
    main(sys.argv[1:])
