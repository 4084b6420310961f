"""The name of a cached result: a hash of its input, its settings and the code that makes it.

The code is found from the imports, starting at the result's makers: a manual list would become
outdated. A module that is imported by name (`import_module`) is a choice, and no part of the walk:
its caller puts what was chosen into the key. So the reader of a source is a maker of its own, and
other formats' readers don't count, nor does the table that they are chosen from.

What counts
- The makers' names, and of each module of the walk the syntax tree.
- Shipped files that they find by a literal name.
- The version of each library that they import, at their top or in a function, and of those that it
  loads by itself (BEHIND). One that isn't installed counts as absent.

What doesn't
- NEUTRAL modules, which can't change a byte of a result: those that open and write files or
  distribute tasks, those that make a plan, whose values are part of each result's content, and
  those that choose a source's reader, refuse a source, or tell of it.
- Comments, docstrings, comments of settings, log lines, and texts of messages
  (message_texts.py).
"""

import hashlib
import json
import sys
from collections.abc import Collection, Iterable, Iterator, Mapping
from fnmatch import filter as matching
from functools import cache
from importlib.metadata import Distribution, distributions
from itertools import chain
from pathlib import Path
from types import ModuleType
from typing import Any

from stereocell.storage.assets import find_asset
from stereocell.storage.source_code import keep_sources, read_source

# packages and modules below `stereocell` whose code changes no byte of a result
NEUTRAL = (
    "storage",
    "engine",
    "model.errors",
    "model.settings",
    "model.timing",
    "kernels.cache_place",
    "building.settings",
    "building.plan",
    "building.plan_file",
    "building.out_folder",
    "read.readers",
    "read.file_kind",
    "read.remarks",
)
# import name of a library -> those of the libraries that it loads by itself; `*`: any ending
BEHIND = {
    "bioio": ("bioio_*",),
    "pydicom": ("gdcm", "openjpeg", "pylibjpeg"),  # read/dicom/stored_values.py
    "tifffile": ("imagecodecs",),
    "zarr": ("numcodecs",),
}
ABSENT = ""  # version of a library that isn't installed
_PACKAGE = Path(__file__).parents[1]
_NAME = _PACKAGE.name


def key_of(content: Any, *makers: ModuleType | str) -> str:
    """Return the name of a result, 20 hexadecimal digits.

    content  the inputs of the result, as values of JSON
    makers   the modules, or their dotted names, whose code makes it
    """
    digests = [_digest(_name(maker)) for maker in makers]
    keep_sources()
    return hashlib.sha256(json.dumps([content, digests], sort_keys=True).encode()).hexdigest()[:20]


def libraries_of(*makers: ModuleType | str) -> dict[str, str]:
    """Return the version of each installed library that the makers' code imports, by name."""
    found: dict[str, str] = {}
    for maker in makers:
        found |= dict(_reach(_name(maker), ())[1])
    keep_sources()
    return {name: version for name, version in found.items() if version != ABSENT}


def _name(maker: ModuleType | str) -> str:
    return maker if isinstance(maker, str) else maker.__name__


@cache
def _digest(module: str) -> str:
    files, libraries = _reach(module, NEUTRAL)
    digest = hashlib.sha256(json.dumps([module, libraries]).encode())
    for file in files:
        content = file.read_bytes()
        digest.update(read_source(content).code.encode() if file.suffix == ".py" else content)
    return digest.hexdigest()


@cache
def _reach(
    module: str, left_out: tuple[str, ...]
) -> tuple[tuple[Path, ...], tuple[tuple[str, str], ...]]:
    """Return our files that a module needs, its own included, and (library, version) pairs."""
    found: dict[Path, None] = {}
    foreign: set[str] = set()
    seen = {_NAME}  # the package's own names are for its users; no result depends on them
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name in seen:
            continue
        seen.add(name)
        top = name.partition(".")[0]
        if top != _NAME:
            foreign.add(top)
            continue
        file = _modules().get(name)  # None for the name of something inside a module
        if file is not None and file not in found and not _is_below(name, left_out):
            found[file] = None
            assets, imports = _needs(file)
            found.update(dict.fromkeys(assets))
            waiting += imports
    versions = {pair for top in foreign - sys.stdlib_module_names for pair in _versions(top)}
    return tuple(sorted(found)), tuple(sorted(versions))


def _versions(top: str) -> Iterator[tuple[str, str]]:
    """Yield (library, version) of what has an import name, and of what it loads by itself."""
    known = _distributions()
    behind = (matching(known, pattern) or [pattern] for pattern in BEHIND.get(top, ()))
    for name in chain([top], *behind):
        yield from map(_version, known[name]) if name in known else [(name, ABSENT)]


@cache
def _version(package: Distribution) -> tuple[str, str]:
    """Return a package's name and version; each time they are asked for, its metadata is parsed."""
    metadata = package.metadata
    return metadata["Name"], metadata["Version"]


def _is_below(name: str, parts: Collection[str]) -> bool:
    """Return whether a module is one of `parts` below `stereocell`, or lies in one of them."""
    return any(name == f"{_NAME}.{part}" or name.startswith(f"{_NAME}.{part}.") for part in parts)


@cache
def _distributions() -> Mapping[str, tuple[Distribution, ...]]:
    """Return the installed packages by the names under which they are imported.

    importlib.metadata.packages_distributions() takes a second, since it makes a path of each file,
    and misses a package that is one extension module.
    """
    found: dict[str, list[Distribution]] = {}
    for package in distributions():
        tops = (package.read_text("top_level.txt") or "").split() or {
            line.partition(",")[0].partition("/")[0].partition(".")[0]
            for line in (package.read_text("RECORD") or "").splitlines()
        }
        for top in tops:
            found.setdefault(top, []).append(package)
    return {top: tuple(packages) for top, packages in found.items()}


@cache
def _modules() -> Mapping[str, Path]:
    """Return the files of our modules by their dotted names."""
    return {
        ".".join((_NAME, *file.relative_to(_PACKAGE).with_suffix("").parts)).removesuffix(
            ".__init__"
        ): file
        for file in _PACKAGE.rglob("*.py")
    }


@cache
def _needs(file: Path) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    """Return the shipped files and the modules that a file of ours names."""
    source = read_source(file.read_bytes())
    return tuple(_files(source.assets)), source.imports


def _files(assets: Iterable[str]) -> Iterator[Path]:
    for name in assets:
        asset = find_asset(name)
        yield from asset.rglob("*.*") if asset.is_dir() else [asset]
