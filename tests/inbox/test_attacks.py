"""Attacks on an inbox are refused in one line, and it goes on (support/server/inbox_attacks.py)."""

import http.client
import json
import socket
import ssl
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from stereocell.serve import inbox_app
from stereocell.serve import server as serve_module
from stereocell.serve.access import COOKIE
from stereocell.serve.inbox_server import InboxServer
from support.identity_search import find
from support.server.inbox_attacks import ITEM, MARK, REQUESTS, SIZE, Request, archives
from support.server.inbox_client import InboxClient, serving_inbox
from support.server.timeouts import PATIENCE_S

FEWEST = 150


def look_up(host: str, port: int, *args: Any, **options: Any) -> list[Any]:
    """Look up hosts like an attacker's name server that knows three names; accept IP addresses."""
    known = {
        "inside.example": ["10.0.0.5"],
        "both.example": ["93.184.216.34", "127.0.0.1"],
        "example.org": ["93.184.216.34"],
    }
    if host in known:
        return [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (ip, port)) for ip in known[host]]
    if any(letter in host for letter in "ghijklmnopqrstuvwyz") and "localhost" not in host.lower():
        raise socket.gaierror("no such host")  # no test asks the network
    return real_look_up(host, port, *args, **options)


real_look_up = socket.getaddrinfo


def send(port: int, one: Request, item: str) -> tuple[int, bytes]:
    """Send a request unchanged, even if it is malformed; return status and content."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE_S)
    headers = {"Host": "localhost", **one.headers}
    if "Content-Length" not in headers and "Transfer-Encoding" not in headers:
        headers["Content-Length"] = str(len(one.body))
    try:
        connection.putrequest(one.method, one.path.replace(ITEM, item), True, True)
        for name, value in headers.items():
            connection.putheader(name, value.encode("latin-1"))
        connection.endheaders(one.body or None)
        answer = connection.getresponse()
        return answer.status, answer.read()
    finally:
        connection.close()


def is_one_line(content: bytes) -> bool:
    """Return whether an answer is one line, as JSON or as text."""
    text = content.decode()
    if text.startswith("{"):
        found = json.loads(text)
        return list(found) == ["line"] and "\n" not in found["line"] and MARK not in text
    return "\n" not in text.rstrip("\n") and MARK not in text


@pytest.mark.slow
def test_every_attack_is_refused_in_one_line_and_leaves_nothing(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    caplog: pytest.LogCaptureFixture,
) -> None:
    # All requests appear to come from other machines.
    monkeypatch.setattr(inbox_app, "_is_on_this_machine", lambda _: False)
    monkeypatch.setattr(socket, "getaddrinfo", look_up)
    packed = list(archives())
    with serving_inbox(tmp_path) as server:
        client = InboxClient(server.port)
        item = client.announce([("a.nii", bytes(SIZE))])
        wrong = {}
        for one in REQUESTS:
            status, content = send(server.port, one, item)
            if status not in one.right or not is_one_line(content):
                wrong[one.name] = status, content[:200]
        assert wrong == {}
        for archive in packed:
            own = client.hand_in([(archive.file, archive.content)])
            state = client.wait(own, "failed", "understood")
            if not state["line"].startswith(archive.line) or MARK in state["line"]:
                wrong[archive.name] = state["doing"], state["line"]
            assert client.ask("DELETE", f"/items/{own}")[0] == 204
        assert wrong == {}
        assert client.ask("DELETE", f"/items/{item}")[0] == 204
        assert find(tmp_path, [MARK]) == []
        client.hand_in([("good.bin", bytes(10))])  # the inbox goes on
    assert len({one.name for one in REQUESTS}) + len(packed) >= FEWEST
    assert sorted(one.name for one in tmp_path.iterdir()) == ["box", "page"]
    assert caplog.text == ""
    assert capfd.readouterr() == ("", "")
    with capfd.disabled():
        print(f"\n{len(REQUESTS)} requests and {len(packed)} archives refused")


# --- rights


@pytest.fixture
def shared(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> Iterator[InboxServer]:
    monkeypatch.setattr(serve_module, "find_addresses", lambda: ["127.0.0.1"])
    with serving_inbox(tmp_path, lan=True) as server:
        yield server
    capfd.readouterr()  # the codes


def ask(
    server: InboxServer, method: str, path: str, *, cookie: str = "", body: bytes = b""
) -> http.client.HTTPResponse:
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    connection = http.client.HTTPSConnection(
        "127.0.0.1", server.port, timeout=PATIENCE_S, context=context
    )
    headers = {"Cookie": f"{COOKIE}={cookie}"} if cookie else {}
    connection.request(method, path, body, headers)
    answer = connection.getresponse()
    answer.content = answer.read()  # type: ignore[attr-defined]
    connection.close()
    return answer


def session(server: InboxServer, token: str) -> str:
    answer = ask(server, "GET", f"/?token={token}")
    assert answer.status == 303
    return str(answer.headers["Set-Cookie"].partition("=")[2].partition(";")[0])


NEW = json.dumps({"files": [["a.nii", 4]]}).encode()


def test_the_token_that_uploads_is_not_the_token_that_views(shared: InboxServer) -> None:
    assert shared.gate is not None
    assert shared.uploaders is not None
    assert shared.gate.token != shared.uploaders.token
    uploader = session(shared, shared.uploaders.token)
    viewer = session(shared, shared.gate.token)
    created = ask(shared, "POST", "/items", cookie=uploader, body=NEW)
    assert created.status == 201
    item = json.loads(created.content)["id"]  # type: ignore[attr-defined]
    for method, path in (
        ("POST", "/items"),
        ("PATCH", f"/items/{item}/bytes"),
        ("DELETE", f"/items/{item}"),
        ("PUT", f"/items/{item}/choices"),
        *(("POST", f"/items/{item}/{verb}") for verb in ("look", "build", "pause", "cancel")),
    ):
        for cookie in (viewer, "", "x" * 43):
            body = b"" if method == "DELETE" else NEW
            answer = ask(shared, method, path, cookie=cookie, body=body)
            assert answer.status == 403, (method, path)
    for path in (
        f"/items/{item}/understood",
        f"/items/{item}/view/",
        f"/items/{item}/slices/z.png",
    ):
        assert ask(shared, "GET", path, cookie=viewer).status == 404  # nothing to look at yet
        assert ask(shared, "GET", path).status == 403
    assert ask(shared, "GET", "/", cookie=viewer).status == 200
    shown = [shared.inbox.state(may_upload=may)["items"] for may in (True, False)]
    assert [len(items) for items in shown] == [1, 0]


def test_a_token_works_once_and_an_uploader_gets_no_less_by_the_other(shared: InboxServer) -> None:
    assert shared.gate is not None
    assert shared.uploaders is not None
    token = shared.uploaders.token
    uploader = session(shared, token)
    assert ask(shared, "GET", f"/?token={token}").status == 403
    other = ask(shared, "GET", f"/?token={shared.gate.token}", cookie=uploader)
    assert (other.status, other.headers["Set-Cookie"]) == (303, None)
    viewer = session(shared, shared.gate.token)
    raised = ask(shared, "GET", f"/?token={shared.uploaders.token}", cookie=viewer)
    assert raised.headers["Set-Cookie"]  # a viewer may become an uploader
    for sent in ("", "x", token[:-1], "a" * 5000):
        assert ask(shared, "GET", f"/?token={sent}").status in (403, 200)
        assert ask(shared, "POST", f"/items?token={sent}", body=NEW).status == 403
    assert ask(shared, "POST", f"/items?token={shared.uploaders.token}", body=NEW).status == 403
