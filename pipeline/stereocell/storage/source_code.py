"""What of a module's source counts in the name of a result: its code, and what it names.

To parse all our modules takes a second of each command. So what was found is kept beside the
compiled kernels, by the hash of the bytes it was found in: a source that changed is another one.
"""

import ast
import hashlib
import json
import os
import sys
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from stereocell.kernels.cache_place import find_home
from stereocell.storage import message_texts
from stereocell.storage.assets import find_asset
from stereocell.storage.message_texts import is_log_line, without_messages

_FINDER = find_asset.__name__
_MAX_SOURCES = 2000  # sources that are kept; beyond, those alone that this process has read


class Source(NamedTuple):
    """A module's source."""

    code: str  # SHA-256 of its syntax tree without docstrings and texts of messages
    assets: tuple[str, ...]  # the shipped files that it finds by a literal name
    imports: tuple[str, ...]  # dotted names


def read_source(content: bytes) -> Source:
    """Return what counts of a module's source."""
    name = hashlib.sha256(content).hexdigest()
    kept = _kept()
    found = kept.get(name) or _parsed(content)
    if _read.setdefault(name, found) is not kept.get(name):
        _new.add(name)
    return found


def keep_sources() -> None:
    """Keep what was parsed for other commands. Where it can't be, they parse anew."""
    place = _place()
    if not _new or place is None:
        return
    known = _kept() | _read
    _kept().update(_read)
    _new.clear()
    text = json.dumps(known if len(known) <= _MAX_SOURCES else _read)
    with suppress(OSError):
        handle, name = tempfile.mkstemp(dir=place.parent)
        with open(handle, "w", encoding="utf-8") as file:
            file.write(text)
        os.replace(name, place)


_read: dict[str, Source] = {}  # by this process
_new: set[str] = set()  # of these, what is kept nowhere


@cache
def _place() -> Path | None:
    """Return the file of what was found by this very code; None: there is no place for it."""
    home = find_home()
    code = b"".join(Path(file).read_bytes() for file in (__file__, message_texts.__file__))
    finder = hashlib.sha256(code + sys.version.encode()).hexdigest()[:12]
    return home and home / f"sources-{finder}.json"


@cache
def _kept() -> dict[str, Source]:
    place = _place()
    with suppress(OSError, ValueError, TypeError, AttributeError):
        if place is not None:
            found = json.loads(place.read_text("utf-8"))
            return {
                name: Source(str(code), tuple(assets), tuple(imports))
                for name, (code, assets, imports) in found.items()
            }
    return {}


def _parsed(content: bytes) -> Source:
    tree = ast.parse(content)
    assets = tuple(_assets(tree)) if _FINDER.encode() in content else ()
    imports = tuple(_imports(tree.body))
    bare = _Bare(has_settings=b"setting" in content).visit(without_messages(tree))
    return Source(hashlib.sha256(ast.dump(bare).encode()).hexdigest(), assets, imports)


def _assets(tree: ast.Module) -> Iterator[str]:
    """Yield the names of the shipped files that a module finds by a literal one."""
    for node in ast.walk(tree):
        match node:
            case ast.Call(func=ast.Name(id=id), args=[ast.Constant(value=name)]) if id == _FINDER:
                yield str(name)


def _imports(statements: Iterable[ast.AST]) -> Iterator[str]:
    """Yield the imports of statements and of those inside them; expressions contain none."""
    for node in statements:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        for inside in ("body", "handlers", "cases", "orelse", "finalbody"):
            yield from _imports(getattr(node, inside, ()))


class _Bare(ast.NodeTransformer):
    """Removes from a syntax tree all parts that change no result.

    has_settings  whether the module may define settings, the one such part of an expression; most
        modules don't, and expressions are most of a tree
    """

    def __init__(self, *, has_settings: bool) -> None:
        self.has_settings = has_settings

    def visit(self, node: ast.AST) -> Any:
        """Visit statements, and expressions where one may hold such a part."""
        if isinstance(node, ast.expr) and not self.has_settings:
            return node
        return super().visit(node)

    def generic_visit(self, node: ast.AST) -> ast.AST:
        """Visit a node's own; a body of which nothing is left does nothing."""
        super().generic_visit(node)
        if getattr(node, "body", None) == []:
            node.body = [ast.Pass()]  # type: ignore[attr-defined]
        return node

    def visit_Expr(self, node: ast.Expr) -> ast.AST | None:
        """Remove docstrings (any lone constant), prints and log lines."""
        if isinstance(node.value, ast.Constant) or is_log_line(node):
            return None
        return self.generic_visit(node)

    def visit_Pass(self, node: ast.Pass) -> None:
        """Remove statements without effect."""

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """Remove the comment of a setting, which follows its default."""
        if isinstance(node.func, ast.Name) and node.func.id == "setting":
            node.args, node.keywords = node.args[:1], []
        return self.generic_visit(node)
