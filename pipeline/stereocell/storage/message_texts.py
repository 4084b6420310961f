"""Texts of a module that reach people alone: no key of a result counts them.

A message is all that is raised, asserted, printed, logged or given to the constructor of an error,
or to ONE_LINE, which make errors of it. A text that is put together elsewhere is one too where
nothing else can hold it: each use of what holds it lies in a message, or asks whether it is empty.
What holds it is a variable of a function, or a private function or constant of the module. A text
that is compared, looked up, returned by a public function, put into a list or an attribute, or
passed to any other function may change a byte, and counts. So does that of an error in RECORDED.
"""

import ast
from collections import defaultdict
from collections.abc import Sequence
from typing import Any

ONE_LINE = {"one_line", "raise_if_short"}  # of storage/library_errors.py
RECORDED = {"NoSurfaceError"}  # of such an error a result keeps the text
_LOG_METHODS = {"print", "log", "debug", "info", "warning", "warn", "error"}
_LOG_OBJECTS = {"console", "logger", "logging", "log", "warnings"}
_DECORATORS = {"cache", "classmethod", "property", "staticmethod"}  # all others may call it

Holder = tuple[int, str]  # a function's number, 0 for the module, and a name in it
_MESSAGE: Holder = (-1, "a message")
_OTHER: Holder = (-1, "anything else")


def is_log_line(node: ast.Expr) -> bool:
    """Return whether a statement prints or logs, and does nothing else."""
    match node.value:
        case ast.Call(func=ast.Name(id="print")):
            return True
        case ast.Call(func=ast.Attribute(value=ast.Name(id=owner), attr=method)):
            return owner in _LOG_OBJECTS and method in _LOG_METHODS
    return False


def without_messages(tree: ast.Module) -> ast.Module:
    """Return a module's tree without the texts of its messages; the tree itself is changed."""
    finder = _Finder()
    bare: ast.Module = finder.visit(tree)
    held = finder.held_by_messages()
    for text, holder in finder.texts:
        if holder in held and text.value:  # an empty one stays: its holder may be asked for that
            text.value = None
    return bare


class _Finder(ast.NodeTransformer):
    """Removes texts from messages, and finds the others and what holds them.

    uses   of each name, where it is used: in what another holder holds, in a message, or elsewhere
    texts  which a holder may hold, and which
    """

    def __init__(self) -> None:
        self.uses: dict[Holder, set[Holder]] = defaultdict(set)
        self.texts: list[tuple[ast.Constant, Holder]] = []
        self._place = _OTHER  # of the expression that is visited
        self._scopes: list[int | None] = [0]  # functions, innermost last; None: a class
        self._returned = _OTHER  # what holds a function's value
        self._has_bases = False  # of the class around
        self._functions = 0

    def held_by_messages(self) -> set[Holder]:
        """Return the holders that are used, and in messages or by other such holders alone."""
        found: set[Holder] = set()
        while (
            more := {
                holder
                for holder, places in self.uses.items()
                if places != {holder} and places <= {*found, holder, _MESSAGE}
            }
            - found
        ):
            found |= more
        return found

    def visit_FunctionDef(self, node: ast.FunctionDef | ast.AsyncFunctionDef) -> ast.AST:
        """Visit a function; a private one of the module holds what it returns."""
        head = [*node.decorator_list, node.args, *filter(None, [node.returns])]
        for part in head:
            self._visit_at(_OTHER, part)
        names = {one.id if isinstance(one, ast.Name) else "" for one in node.decorator_list}
        is_ours = self._scopes in ([0], [0, None]) and not self._has_bases
        before = self._scopes, self._returned, self._has_bases
        self._functions += 1
        self._scopes = [*self._scopes, self._functions]
        is_holder = is_ours and _is_private(node.name) and names <= _DECORATORS
        self._returned, self._has_bases = (0, node.name) if is_holder else _OTHER, False
        node.body = self._visit_all(node.body)
        self._scopes, self._returned, self._has_bases = before
        return node

    visit_AsyncFunctionDef = visit_FunctionDef

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.AST:
        """Visit a class; a base's methods, in another module, may call those of one with bases."""
        before = self._scopes, self._has_bases
        self._scopes, self._has_bases = [*self._scopes, None], bool(node.bases)
        self.generic_visit(node)
        self._scopes, self._has_bases = before
        return node

    def visit_Raise(self, node: ast.Raise) -> ast.AST:
        """Visit what is raised: all of it is a message."""
        is_recorded = isinstance(node.exc, ast.Call) and _name(node.exc.func) in RECORDED
        for field in ("exc", "cause"):
            if (part := getattr(node, field)) is not None:
                setattr(node, field, self._visit_at(_OTHER if is_recorded else _MESSAGE, part))
        return node

    def visit_Assert(self, node: ast.Assert) -> ast.AST:
        """Visit an assertion: what it says is a message."""
        node.test = self._ask(node.test)
        node.msg = node.msg and self._visit_at(_MESSAGE, node.msg)
        return node

    def visit_Expr(self, node: ast.Expr) -> ast.AST:
        """Visit a statement that only calls."""
        node.value = self._visit_at(_MESSAGE if is_log_line(node) else _OTHER, node.value)
        return node

    def visit_Return(self, node: ast.Return) -> ast.AST:
        """Visit what a function returns."""
        node.value = node.value and self._visit_at(self._returned, node.value)
        return node

    def visit_If(self, node: ast.If | ast.While) -> ast.AST:
        """Visit what depends on a text's being empty."""
        node.test = self._ask(node.test)
        node.body, node.orelse = self._visit_all(node.body), self._visit_all(node.orelse)
        return node

    visit_While = visit_If

    def visit_Assign(self, node: ast.Assign) -> ast.AST:
        """Visit the value of a variable, which holds its texts."""
        if len(node.targets) > 1:
            return self.generic_visit(node)
        node.targets = [self.visit(node.targets[0])]
        node.value = self._visit_at(self._holder(node.targets[0]), node.value)
        return node

    def visit_AugAssign(self, node: ast.AugAssign | ast.AnnAssign | ast.NamedExpr) -> ast.AST:
        """Visit the same in its other forms."""
        if node.value is not None:
            node.value = self._visit_at(self._holder(node.target), node.value)
        if isinstance(node, ast.NamedExpr):
            self._use(node.target.id)
        else:
            node.target = self.visit(node.target)
        return node

    visit_AnnAssign = visit_AugAssign
    visit_NamedExpr = visit_AugAssign

    def visit_Global(self, node: ast.Global | ast.Nonlocal) -> ast.AST:
        """Visit names of another scope than the one that assigns to them."""
        for name in node.names:
            self._use(name)
        return node

    visit_Nonlocal = visit_Global

    def generic_visit(self, node: ast.AST) -> ast.AST:
        """Visit the parts of a node; none holds a text of the whole, unless all is a message."""
        before = self._place
        self._place = _MESSAGE if before == _MESSAGE else _OTHER
        super().generic_visit(node)
        self._place = before
        return node

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        """Visit a text."""
        if not isinstance(node.value, str):
            return node
        if _is_private(node.value):  # getattr(_, "_name")
            self._use(node.value)
        if self._place == _MESSAGE:
            return ast.Constant(None)
        if self._place != _OTHER:
            self.texts.append((node, self._place))
        return node

    def visit_JoinedStr(self, node: ast.JoinedStr) -> ast.AST:
        """Visit a text that is put together."""
        for part in node.values:
            if isinstance(part, ast.FormattedValue):
                part.value = self.visit(part.value)
                self._visit_at(_MESSAGE if self._place == _MESSAGE else _OTHER, part.format_spec)
            else:
                self.visit(part)
        return ast.Constant(None) if self._place == _MESSAGE else node

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        """Visit one text or the other."""
        node.test = self._ask(node.test)
        node.body, node.orelse = self.visit(node.body), self.visit(node.orelse)
        return node

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.AST:
        """Visit one text or the other."""
        node.values = self._visit_all(node.values)
        return node

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        """Visit two texts in a row."""
        if not isinstance(node.op, ast.Add):
            return self.generic_visit(node)
        node.left, node.right = self.visit(node.left), self.visit(node.right)
        return node

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """Visit a call; the value of a private function goes where the call stands."""
        place = self._place
        if place != _MESSAGE:
            place = _MESSAGE if _makes_error(_name(node.func)) else _OTHER
        node.func = self.visit(node.func)
        node.args = [self._visit_at(place, one) for one in node.args]
        node.keywords = [self._visit_at(place, one) for one in node.keywords]
        return node

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        """Visit a method's name; a private one is this module's."""
        if isinstance(node.ctx, ast.Load) and _is_private(node.attr):
            self._use(node.attr)
        return self.generic_visit(node)

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """Visit a name."""
        if isinstance(node.ctx, ast.Load):
            self._use(node.id)
        return node

    def _ask(self, test: Any) -> Any:
        """Visit a condition; whether a variable is empty tells nothing of its texts."""
        match test:
            case ast.Name():
                return test
            case ast.NamedExpr(target=target):
                test.value = self._visit_at(self._holder(target), test.value)
            case ast.UnaryOp(op=ast.Not()):
                test.operand = self._ask(test.operand)
            case ast.BoolOp():
                test.values = [self._ask(one) for one in test.values]
            case _:
                return self._visit_at(_MESSAGE if self._place == _MESSAGE else _OTHER, test)
        return test

    def _holder(self, target: ast.AST) -> Holder:
        """Return what holds a text that is assigned here."""
        scope = self._scopes[-1]
        if scope is None or not isinstance(target, ast.Name):
            return _OTHER
        return (scope, target.id) if scope or _is_private(target.id) else _OTHER

    def _use(self, name: str) -> None:
        """Note the use of a name, which may be of any scope around."""
        for scope in self._scopes:
            if scope is not None:
                self.uses[scope, name].add(self._place)

    def _visit_at(self, place: Holder, node: Any) -> Any:
        before, self._place = self._place, place
        visited = node and self.visit(node)
        self._place = before
        return visited

    def _visit_all(self, nodes: Sequence[Any]) -> list[Any]:
        return [self.visit(node) for node in nodes]


def _name(function: ast.expr) -> str:
    match function:
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return name
    return ""


def _makes_error(name: str) -> bool:
    is_class = name[:1].isupper() and name.endswith(("Error", "Warning")) and name not in RECORDED
    return is_class or name in ONE_LINE


def _is_private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__") and name.isidentifier()
