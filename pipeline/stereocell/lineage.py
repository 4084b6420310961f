"""What code a result comes from: the modules that make it and the libraries that they import.

Results are kept under names that hold this, so that neither an upgrade of a library nor a change of
any module on the way from voxels to file passes for nothing. Found from the sources themselves: a
list by hand would be forgotten.
"""

import ast
import hashlib
import json
import sys
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.metadata import packages_distributions, version
from pathlib import Path
from types import ModuleType
from typing import Any

from stereocell.assets import find_asset

_PACKAGE = Path(__file__).parent
_NAME = _PACKAGE.name


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
        file = _source(name)
        if file is not None and file not in found:
            found[file] = None
            assets, imports = _needs(file)
            found.update(dict.fromkeys(assets))
            waiting += imports
    known = _distributions()  # a lone extension module isn't in it: it has its own name
    tops = foreign - sys.stdlib_module_names
    names = {name for top in tops for name in known.get(top, (top,))}
    return tuple(sorted(found)), tuple((name, version(name)) for name in sorted(names))


@cache
def _distributions() -> Mapping[str, list[str]]:
    """Return the names of the installed packages by what they are imported as: a second's work."""
    return packages_distributions()


def _source(name: str) -> Path | None:
    """Return the file of one of our modules; None if the name is something inside a module."""
    path = _PACKAGE.joinpath(*name.split(".")[1:])
    candidates = (path.with_suffix(".py"), path / "__init__.py")
    return next((file for file in candidates if file.is_file()), None)


@cache
def _needs(file: Path) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    """Return what ships beside the code and the modules that a file of ours names."""
    tree = ast.parse(file.read_bytes())
    return tuple(_assets(tree)), tuple(_imports(tree))


def _assets(tree: ast.Module) -> Iterator[Path]:
    """Yield the files that ship beside the code and that a module finds by a literal name."""
    for node in ast.walk(tree):
        match node:
            case ast.Call(func=ast.Name(id="find_asset"), args=[ast.Constant(value=name)]):
                asset = find_asset(str(name))
                yield from asset.rglob("*.*") if asset.is_dir() else [asset]


def _imports(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
