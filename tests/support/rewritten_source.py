"""Run a command of StereoCell by code that was rewritten without changing any result.

    PYTHONPATH=tests python -m support.rewritten_source [--raise=STEP] build IN -o OUT

Each module of the package gets another comment, docstring and log line. Each function gets other
names for its local variables. `kernels` is not rewritten, because numba keys compiled loops by
their files. `--raise=BuildUnit` also raises the VERSION of that step.
"""

import ast
import logging
import sys
from collections.abc import Iterable, Iterator
from importlib.machinery import SourceFileLoader
from types import CodeType

_PACKAGE, _KERNELS = "stereocell", "stereocell.kernels"
_SCOPES = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Lambda)
_INNER = (*_SCOPES, ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)


def rewrite(source: str, raised: str = "") -> tuple[str, int]:
    """Return a module's source, rewritten, and the number of renamed variables.

    raised  the class of the step whose VERSION is raised; empty: none
    """
    tree = ast.parse(source)
    renamed = 0
    for function in _functions(tree):
        names = {name: f"{name}_renamed" for name in _own_variables(function)}
        renamed += len(names)
        for node in _own_nodes(function.body):
            if isinstance(node, ast.Name) and node.id in names:
                node.id = names[node.id]
        _replace_docstring(function)
        place = _first_statement(function)
        function.body[place:place] = _log_line()
    _replace_docstring(tree)
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef) and node.name == raised:
            _raise_version(node)
    return f"# This comment is new.\n{ast.unparse(ast.fix_missing_locations(tree))}\n", renamed


def _log_line() -> list[ast.stmt]:
    """Return statements that write a log line; their only name is one that no function uses."""
    line = f"import logging as _new; _new.getLogger({_PACKAGE!r}).debug('called')"
    return ast.parse(line).body


def _raise_version(step: ast.ClassDef) -> None:
    for node in step.body:
        match node:
            case ast.AnnAssign(target=ast.Name(id="VERSION"), value=ast.Constant() as version):
                version.value += 1


def _functions(tree: ast.Module) -> list[ast.FunctionDef]:
    return [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]


def _own_nodes(body: Iterable[ast.AST]) -> Iterator[ast.AST]:
    """Yield the nodes of a function's body, except those in inner scopes."""
    for node in body:
        if not isinstance(node, _INNER):
            yield node
            yield from _own_nodes(ast.iter_child_nodes(node))


def _own_variables(function: ast.FunctionDef) -> set[str]:
    """Return the variables that a function assigns and that can be renamed safely."""
    own = list(_own_nodes(function.body))
    assigned = {
        node.id for node in own if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    }
    arguments = {node.arg for node in ast.walk(function) if isinstance(node, ast.arg)}
    inner_nodes = set(ast.walk(function)) - set(own)
    inner = {node.id for node in inner_nodes if isinstance(node, ast.Name)}
    kept: set[str] = set()
    for node in own:
        match node:
            case ast.Global(names=names) | ast.Nonlocal(names=names):
                kept |= {*names}
            case ast.ExceptHandler(name=str(name)) | ast.MatchAs(name=str(name)):
                kept.add(name)
            case ast.MatchStar(name=str(name)) | ast.MatchMapping(rest=str(name)):
                kept.add(name)
            case ast.Import(names=names) | ast.ImportFrom(names=names):
                kept |= {one.asname or one.name.partition(".")[0] for one in names}
    inner_names = {
        name
        for node in inner_nodes
        if isinstance(node, ast.Global | ast.Nonlocal)
        for name in node.names
    }
    return assigned - arguments - inner - kept - inner_names


def _first_statement(node: ast.Module | ast.FunctionDef) -> int:
    """Return the index of the first statement after the docstring."""
    return 0 if ast.get_docstring(node) is None else 1


def _replace_docstring(node: ast.Module | ast.FunctionDef) -> None:
    if ast.get_docstring(node) is not None:
        node.body[0] = ast.Expr(ast.Constant("Another docstring."))


class _Rewriting(logging.Handler):
    """The rewriting of all modules that are imported from now on.

    raised     the class of the step whose VERSION is raised; empty: none
    modules    number of rewritten modules
    variables  number of renamed variables in them
    lines      number of log lines that their functions wrote
    """

    def __init__(self, raised: str) -> None:
        super().__init__()
        self.raised = raised
        self.modules = self.variables = self.lines = 0

    def emit(self, record: logging.LogRecord) -> None:
        self.lines += 1

    def begin(self) -> None:
        plain = SourceFileLoader.get_code

        def get_code(loader: SourceFileLoader, name: str) -> CodeType | None:
            is_ours = f"{name}.".startswith(f"{_PACKAGE}.")
            if not is_ours or f"{name}.".startswith(f"{_KERNELS}."):
                return plain(loader, name)
            source, variables = rewrite(loader.get_data(loader.path).decode(), self.raised)
            self.modules += 1
            self.variables += variables
            return compile(source, loader.path, "exec")

        SourceFileLoader.get_code = get_code  # type: ignore[assignment, method-assign]
        logging.getLogger(_PACKAGE).addHandler(self)
        logging.getLogger(_PACKAGE).setLevel(logging.DEBUG)


def main(arguments: list[str]) -> int:
    """Run a command, and print how much of its code was rewritten."""
    raised = arguments.pop(0).partition("=")[2] if arguments[0].startswith("--raise=") else ""
    rewriting = _Rewriting(raised)
    rewriting.begin()
    from stereocell.cli.__main__ import main as run_command

    code = run_command(arguments)
    print(f"rewritten: {rewriting.modules} {rewriting.variables} {rewriting.lines}")
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
