"""Parts of uvicorn and websockets on which the server relies although they are not public API.

pyproject.toml pins both packages to versions that have these parts. After an update, these tests
name the parts that changed, and serve/test_attacks.py shows whether the server still withstands
attacks.
"""

import ast
import dis
import inspect
import textwrap
import tomllib
from importlib.metadata import version
from pathlib import Path

import uvicorn
from packaging.requirements import Requirement
from uvicorn.protocols.http.h11_impl import H11Protocol, RequestResponseCycle
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from uvicorn.server import ServerState
from websockets.server import ServerProtocol

from stereocell.serve.deadline import HeadDeadline
from stereocell.serve.http_protocol import GuardedHttp, State
from stereocell.serve.lifetime import Lifetime
from stereocell.serve.websocket_protocol import GuardedSocket, _Handshake

MAKE = "__init__(self, config, server_state, app_state, _loop)"
LOST = "connection_lost(self, exc)"
TAKE = "data_received(self, data)"
BUILT_ON: dict[type, list[str]] = {
    H11Protocol: [
        MAKE, "connection_made(self, transport)", LOST, TAKE, "handle_events(self)",
        "_should_upgrade(self)", "handle_websocket_upgrade(self, event)",
        "send_400_response(self, msg)", "on_response_complete(self)", "shutdown(self)",
        "pause_writing(self)", "resume_writing(self)", "timeout_keep_alive_handler(self)",
        "_unset_keepalive_if_required(self)",
        "client", "conn", "cycle", "headers", "loop", "scope", "server_state", "transport",
    ],
    RequestResponseCycle: ["response_complete"],
    WebSocketsSansIOProtocol: [
        MAKE, LOST, TAKE, "handle_text(self, event)", "handle_bytes(self, event)",
        "handle_cont(self, event)", "handle_ping(self)", "handle_pong(self, event)",
        "handle_parser_exception(self)", "keepalive_timeout(self)", "stop_keepalive(self)",
        "shutdown(self)",
        "client", "close_sent", "close_timer", "conn", "disconnected", "handshake_complete",
        "handshake_initiated", "loop", "queue", "transport",
    ],
    uvicorn.Server: [
        "__init__(self, config)", "startup(self, sockets)", "shutdown(self, sockets)",
        "run(self, sockets)", "capture_signals(self)", "config", "force_exit",
        "lifespan", "server_state", "servers", "should_exit", "started",
    ],
    ServerState: ["__init__(self)", "connections", "default_headers", "tasks"],
    ServerProtocol: [
        "send_response(self, response)", "fail(self, code, reason)", "data_to_send(self)",
        "close_sent",
    ],
}  # fmt: skip
OURS: dict[type, type] = {
    HeadDeadline: H11Protocol,
    GuardedHttp: H11Protocol,
    GuardedSocket: WebSocketsSansIOProtocol,
    Lifetime: uvicorn.Server,
    State: ServerState,
    _Handshake: ServerProtocol,
}


def find(owner: type, name: str) -> str:
    """Return a method with its parameters, an attribute's name; "" where there is none."""
    found = inspect.getattr_static(owner, name, None)
    if inspect.isfunction(found):
        return f"{name}({', '.join(inspect.signature(found).parameters)})"
    methods = [one for base in owner.__mro__ for one in vars(base).values()]
    is_set = any(
        step.opname == "STORE_ATTR" and step.argval == name
        for one in methods
        if inspect.isfunction(one)
        for step in dis.get_instructions(one)
    )
    return name if found is not None or is_set else ""


def test_the_parts_of_uvicorn_that_the_server_overrides_exist() -> None:
    changed = [
        f"{owner.__module__}.{owner.__name__}: {wanted}, found {found or 'none'}"
        for owner, names in BUILT_ON.items()
        for wanted in names
        if (found := find(owner, wanted.partition("(")[0])) != wanted
    ]
    versions = ", ".join(f"{name} {version(name)}" for name in ("uvicorn", "websockets"))
    assert not changed, f"{versions} changed what serve_*.py builds on: {changed}"


def test_a_changed_part_of_uvicorn_is_reported() -> None:
    class Newer(H11Protocol):
        def send_400_response(self, message: str) -> None: ...  # type: ignore[override]

    assert find(Newer, "send_400_response") == "send_400_response(self, message)"
    assert find(Newer, "shutdown") == "shutdown(self)"
    assert find(Newer, "scope") == "scope"
    assert find(Newer, "no_such_thing") == ""


def test_the_list_of_overridden_parts_is_complete() -> None:
    """The list names every part of theirs that our classes override or use."""
    for ours, theirs in OURS.items():
        used = {name for name, one in vars(ours).items() if inspect.isfunction(one)}
        for node in ast.walk(ast.parse(textwrap.dedent(inspect.getsource(ours)))):
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                used |= {node.attr} if node.value.id == "self" else set()
        listed = {name.partition("(")[0] for name in BUILT_ON[theirs]}
        assert not {name for name in used - listed if find(theirs, name)}, ours


def test_both_packages_are_pinned_below_the_next_version() -> None:
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text("utf-8"))[
        "project"
    ]
    wanted = {one.name: one.specifier for one in map(Requirement, project["dependencies"])}
    for name, next_one in (("uvicorn", "0.55.0"), ("websockets", "18.0")):
        assert wanted[name].contains(version(name)), name
        assert not wanted[name].contains(next_one), name
