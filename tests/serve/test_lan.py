"""Serving on the LAN: TLS, one-time tokens, sessions; no output reveals a used token."""

import hashlib
import http.client
import json
import os
import re
import socket
import ssl
import subprocess
import sys
from contextlib import contextmanager
from subprocess import PIPE
from urllib.request import urlopen

import pytest
import segno
from cryptography import x509
from websockets.exceptions import InvalidStatus

from stereocell.cli.__main__ import main
from stereocell.model.errors import StereoCellError
from stereocell.serve import server as serve_module
from stereocell.serve.access import COOKIE, Gate
from stereocell.serve.lan import draw_qr, find_addresses, find_names, make_certificate
from stereocell.serve.server import BundleServer
from support import plain_bundle
from support.exhaustive import sweep
from support.server.running import serving
from support.server.timeouts import PATIENCE_S, connect


def certificate(port):
    """Return the server's certificate (PEM), and its SHA-256 in the form of the terminal."""
    pem = ssl.get_server_certificate(("127.0.0.1", port))
    digest = hashlib.sha256(ssl.PEM_cert_to_DER_cert(pem)).hexdigest().upper()
    return pem, ":".join(re.findall("..", digest))


@pytest.fixture
def server(tmp_path, monkeypatch):
    folder = tmp_path / "bundle"
    folder.mkdir()
    (folder / "manifest.json").write_text("{}")
    (folder / "index.html").write_text("<!doctype html>")
    monkeypatch.setattr(serve_module, "find_addresses", lambda: ["127.0.0.1"])
    with serving(tmp_path, lan=True) as found:
        yield found


@pytest.fixture
def context():
    """TLS that accepts any certificate, like a browser whose user went on after its warning."""
    found = ssl.create_default_context()
    found.check_hostname = False
    found.verify_mode = ssl.CERT_NONE
    return found


def ask(server, context, path, method="GET", host=None, cookie=None):
    connection = http.client.HTTPSConnection(
        "127.0.0.1", server.port, timeout=PATIENCE_S, context=context
    )
    headers = {} if cookie is None else {"Cookie": cookie}
    if host is not None:
        headers["Host"] = host
    try:
        connection.request(method, path, headers=headers)
        response = connection.getresponse()
        return response, response.read()
    finally:
        connection.close()


def enter(server, context):
    """Use the server's present token; return the session's cookie."""
    response, _ = ask(server, context, f"/?token={server.gate.token}")
    assert response.status == 303
    return response.headers["Set-Cookie"].split(";")[0]


def test_without_a_session_nothing_is_answered(server, context):
    for path in (
        "/",
        "/manifest.json",
        "/?token=",
        "/?token=wrong",
        "/index.html?token=" + "A" * 43,
    ):
        for method in ("GET", "HEAD", "POST"):
            response, body = ask(server, context, path, method)
            assert response.status == 403
            assert b"doctype" not in body
    for cookie in (f"{COOKIE}=", f"{COOKIE}=wrong", "a=b; c", f"{COOKIE}=\u00e9", "=;=;=" * 100):
        assert ask(server, context, "/", cookie=cookie)[0].status == 403


def test_a_token_gives_a_session_once_and_is_void(server, context):
    token = server.gate.token
    response, _ = ask(server, context, f"/?token={token}")
    assert (response.status, response.headers["Location"]) == (303, "/")
    assert response.headers["Cache-Control"] == "no-store"
    cookie, *attributes = response.headers["Set-Cookie"].split("; ")
    assert set(attributes) == {"Path=/", "Secure", "HttpOnly", "SameSite=Lax"}
    assert token not in cookie
    response, body = ask(server, context, "/", cookie=cookie)
    assert (response.status, body) == (200, b"<!doctype html>")
    assert ask(server, context, f"/?token={token}")[0].status == 403
    # the device that has a session may load its first address again
    again, _ = ask(server, context, f"/?token={token}", cookie=cookie)
    assert (again.status, again.headers["Location"]) == (303, "/")


def test_the_next_device_gets_a_token_of_its_own(server, context):
    first, second = enter(server, context), enter(server, context)
    assert first != second
    for cookie in (first, second):
        assert ask(server, context, "/", cookie=cookie)[0].status == 200


def test_a_preview_does_not_use_a_token_up(server, context):
    path = f"/?token={server.gate.token}"
    assert ask(server, context, path, "HEAD")[0].status == 403
    assert ask(server, context, path)[0].status == 303


def test_a_websocket_needs_the_session_too(server, context):
    address = f"wss://127.0.0.1:{server.port}/bricks"
    for path in ("", f"?token={server.gate.token}"):
        with (
            pytest.raises(InvalidStatus) as refused,
            connect(address + path, ssl=context),
        ):
            pass
        assert refused.value.response.status_code == 403
    headers = {"Cookie": enter(server, context)}
    own = f"https://127.0.0.1:{server.port}"
    with connect(address, ssl=context, origin=own, additional_headers=headers) as client:
        client.send('{"type": "hello", "version": 1}')
        assert '"welcome"' in client.recv(timeout=PATIENCE_S)
    with (
        pytest.raises(InvalidStatus),
        connect(address, ssl=context, origin="https://a.example", additional_headers=headers),
    ):
        pass


def test_other_host_names_are_refused_even_with_a_session(server, context):
    cookie = enter(server, context)
    assert ask(server, context, "/", host="evil.example", cookie=cookie)[0].status == 403


def test_plain_http_gets_nothing_and_ends_nothing(server, context, capfd):
    with socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE_S) as client:
        client.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
        assert b"HTTP/1.1 200" not in client.recv(1000)
    assert ask(server, context, "/")[0].status == 403
    assert capfd.readouterr().err == ""


def test_the_fingerprint_is_that_of_the_certificate(server):
    assert certificate(server.port)[1] == server.fingerprint


def test_a_certificate_is_valid_only_for_the_servers_names(server):
    found = x509.load_pem_x509_certificate(certificate(server.port)[0].encode())
    names = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    listed = {str(name.value).lower() for name in names}
    assert listed == set(find_names(["127.0.0.1"]))
    assert "localhost" in listed
    assert not found.extensions.get_extension_for_class(x509.BasicConstraints).value.ca


def test_a_host_name_that_a_certificate_can_not_hold_is_left_out(monkeypatch):
    monkeypatch.setattr("socket.gethostname", lambda: "my_host")
    names = find_names(["192.168.7.9"])
    assert "my_host" in names
    assert len(make_certificate(names)[1].split(":")) == 32


def test_every_run_has_a_key_of_its_own():
    names = find_names(["192.168.7.9"])
    assert names[0] == "192.168.7.9"
    context, fingerprint = make_certificate(names)
    assert context.minimum_version >= ssl.TLSVersion.TLSv1_2
    assert make_certificate(names)[1] != fingerprint


def test_only_the_qr_code_in_the_output_reveals_a_token(server, context, capfd):
    token = server.gate.token
    enter(server, context)
    ask(server, context, f"/?token={token}")
    ask(server, context, f"/nothing?token={token}", "POST")
    server.invite()
    out, err = capfd.readouterr()
    assert err == ""
    assert token not in out
    assert server.gate.token not in out
    assert f"https://127.0.0.1:{server.port}/" in out
    assert server.fingerprint in out
    assert draw_qr(f"{server.address}?token={server.gate.token}") in out


def test_the_terminal_explains_which_certificate_to_accept_and_why(server, capfd):
    server.invite()
    printed = " ".join(capfd.readouterr().out.split())
    for words in (
        "a token that lets in one device, once",
        "this program made it just now",  # hence the phone's warning
        "browsers allow stereo (WebXR) and head tracking on encrypted pages only",
        "Continue (Advanced, Proceed;",
        f"has this SHA-256 fingerprint: {server.fingerprint}",
        "If the fingerprint differs, somebody intercepts the connection: go back.",
    ):
        assert words in printed


def test_the_qr_code_contains_the_address():
    """The modules are compared with segno's. A line of half blocks has two rows; light is drawn."""
    address = "https://192.168.7.9:8000/?token=" + "x" * 43
    dark = [list(row) for row in segno.make(address, error="l", micro=False).matrix_iter(border=2)]
    halves = {"█": (0, 0), "▀": (0, 1), "▄": (1, 0), " ": (1, 1)}
    rows = []
    for line in draw_qr(address).splitlines():
        bare = re.sub("\x1b\\[[0-9;]*m", "", line)
        if bare:
            rows += zip(*(halves[mark] for mark in bare), strict=True)
    assert [list(row) for row in rows[: len(dark)]] == dark


def test_the_qr_code_is_drawn_by_spaces_if_the_terminal_has_no_blocks():
    address = "https://192.168.7.9:8000/?token=" + "x" * 43
    dark = [list(row) for row in segno.make(address, error="l", micro=False).matrix_iter(border=2)]
    text = draw_qr(address, encoding="latin-1")
    assert text.isascii()
    rows = []
    for line in text.splitlines():
        runs = re.findall("\x1b\\[(7|49)m( +)", line)  # inverted is light; a module is two spaces
        rows.append([int(ground == "49") for ground, run in runs for _ in run[::2]])
    assert [row for row in rows if row] == dark
    assert draw_qr(address, encoding="utf-8") == draw_qr(address)


@contextmanager
def serving_command(arguments, encoding):
    command = [sys.executable, "-m", "stereocell.cli", "serve", *arguments, "--port", "0"]
    environment = {**os.environ, "PYTHONIOENCODING": encoding}
    with subprocess.Popen(
        command, env=environment, stdout=PIPE, stderr=PIPE, encoding=encoding
    ) as process:
        try:
            yield process
        finally:
            process.terminate()
            assert process.communicate(timeout=30)[1] == ""


@pytest.mark.slow
@pytest.mark.parametrize("encoding", sweep(["ascii", "latin-1", "utf-8"], kept=["ascii", "utf-8"]))
def test_the_address_is_json_for_a_program_and_text_in_any_encoding_for_a_person(
    tmp_path, encoding
):
    bundle = tmp_path / "\u00fc\u4e2d" / "bundle"
    plain_bundle.write(bundle.parent, plain_bundle.FILES)
    with serving_command([str(bundle.parent)], encoding) as process:
        line = process.stdout.readline()
        assert line.startswith("http://localhost:")
        shown = str(bundle).encode(encoding, "backslashreplace").decode(encoding)
        assert f" shows {shown}; Ctrl+C ends it" in line
    with serving_command([str(bundle.parent), "--json"], encoding) as process:
        printed = json.loads(process.stdout.readline())
        assert printed["bundle"] == str(bundle)
        assert (printed["bricks"], printed["fingerprint"]) == (True, "")
        assert urlopen(printed["address"], timeout=30).status == 200


def test_each_invitation_is_printed_for_a_program(tmp_path, monkeypatch, capsys):
    for name in ("manifest.json", "index.html"):
        (tmp_path / name).write_text("{}")
    monkeypatch.setattr(serve_module, "find_addresses", lambda: ["127.0.0.1"])
    server = BundleServer(tmp_path, 0, lan=True, for_program=True)
    server.introduce()
    server.invite()
    first = server.gate.token
    server.gate.exchange(first)
    printed = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert printed[0]["fingerprint"] == server.fingerprint
    tokens = (first, server.gate.token)
    assert printed[1:] == [{"invitation": f"{server.address}?token={token}"} for token in tokens]
    server._socket.close()


def test_tokens_and_sessions_are_long_and_differ():
    used = []
    gate = Gate(lambda: used.append(1))
    tokens = {gate.token}
    sessions = set()
    for _ in range(20):
        sessions.add(gate.exchange(gate.token))
        tokens.add(gate.token)
    assert (len(tokens), len(sessions), len(used)) == (21, 20, 20)
    assert min(map(len, tokens | sessions)) >= 43  # 256 bits
    assert all(map(gate.knows, sessions))
    assert not gate.knows("")
    assert gate.exchange("") is None
    assert gate.exchange("\u00e9") is None


def test_no_network_is_one_line(tmp_path, monkeypatch, capsys):
    def none():
        raise StereoCellError(
            "--lan: this machine has no address on a network, expected one: connect it"
        )

    plain_bundle.write(tmp_path, plain_bundle.FILES)
    monkeypatch.setattr(serve_module, "find_addresses", none)
    assert main(["serve", str(tmp_path), "--lan", "--port", "0"]) == 1
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_addresses_are_this_machines():
    try:
        found = find_addresses()
    except StereoCellError:
        pytest.skip("no network here")
    for address in found:
        with socket.socket() as probe:
            probe.bind((address, 0))  # fails for an address of another machine
