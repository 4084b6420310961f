"""What code a result comes from: the modules that make it and the libraries that they import.

Results are kept under names that hold this, so that neither an upgrade of a library nor a change of
any module on the way from voxels to file passes for nothing. Found from the sources themselves: a
list by hand would be forgotten.
"""

import ast
import hashlib
import json
import sys
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from importlib.metadata import Distribution, distributions
from pathlib import Path
from types import ModuleType
from typing import Any

from stereocell.storage.assets import find_asset

_PACKAGE = Path(__file__).parents[1]
_NAME = _PACKAGE.name
_FINDER = find_asset.__name__


def key_of(content: Any, maker: ModuleType) -> str:
    """Return the name of a result: a hash of what it depends on and of the code that makes it."""
    return hashlib.sha256(
        json.dumps([content, _digest(maker.__name__)], sort_keys=True).encode()
    ).hexdigest()[:20]


def libraries_of(maker: ModuleType) -> dict[str, str]:
    """Return the version of each library that the module's code imports, by name."""
    return dict(_lineage(maker.__name__)[1])


@cache
def _digest(module: str) -> str:
    files, libraries = _lineage(module)
    digest = hashlib.sha256(json.dumps(libraries).encode())
    for file in files:
        digest.update(file.read_bytes())
    return digest.hexdigest()


@cache
def _lineage(module: str) -> tuple[tuple[Path, ...], tuple[tuple[str, str], ...]]:
    """Return the files of ours that a module needs, itself among them, and (library, version)."""
    found: dict[Path, None] = {}
    foreign: set[str] = set()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name == _NAME:
            continue  # the package's own names are for its users: nothing is made by them
        if name.split(".")[0] != _NAME:
            foreign.add(name.split(".")[0])
            continue
        file = _modules().get(name)  # none if it is the name of something inside a module
        if file is not None and file not in found:
            found[file] = None
            assets, imports = _needs(file)
            found.update(dict.fromkeys(assets))
            waiting += imports
    known = _distributions()
    tops = foreign - sys.stdlib_module_names
    versions = {made.name: made.version for top in tops for made in known[top]}
    return tuple(sorted(found)), tuple(sorted(versions.items()))


@cache
def _distributions() -> Mapping[str, tuple[Distribution, ...]]:
    """Return the installed packages by what they are imported as.

    As importlib.metadata.packages_distributions() tells it, which makes a path of each of their
    files, needs a second for that, and passes over a package that is one extension module.
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
    """Return what ships beside the code and the modules that a file of ours names."""
    code = file.read_bytes()
    tree = ast.parse(code)
    assets = _assets(tree) if _FINDER.encode() in code else ()
    return tuple(assets), tuple(_imports(tree.body))


def _assets(tree: ast.Module) -> Iterator[Path]:
    """Yield the files that ship beside the code and that a module finds by a literal name."""
    for node in ast.walk(tree):
        match node:
            case ast.Call(func=ast.Name(id=id), args=[ast.Constant(value=name)]) if id == _FINDER:
                asset = find_asset(str(name))
                yield from asset.rglob("*.*") if asset.is_dir() else [asset]


def _imports(statements: Iterable[ast.AST]) -> Iterator[str]:
    """Yield what is imported by statements and by those inside them; expressions hold none."""
    for node in statements:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        for inside in ("body", "handlers", "cases", "orelse", "finalbody"):
            yield from _imports(getattr(node, inside, ()))
