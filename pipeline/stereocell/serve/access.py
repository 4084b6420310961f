"""Access to a server: requests to its own names, from its own origin, with a session on the LAN.

A page of another site can make a browser send requests here. Two checks prevent this. The Host
header must be one of the server's names (against DNS rebinding). The Origin must be the same host
and port (against cross-site websocket hijacking): browsers always send it with a websocket, and
pages can't change it. Requests of another site's page without an Origin (an image, a script, a
frame) carry Sec-Fetch-Site; such a page may only link here. Programs other than browsers send
neither header and need none. On the LAN every request also needs a session: a one-time token, in
the address of the QR code, is exchanged for a cookie and becomes void.

References: RFC 6454 (the Origin header); W3C Fetch Metadata Request Headers.
"""

import secrets
from collections.abc import Callable, Collection
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlsplit

from starlette.datastructures import Headers
from starlette.responses import HTMLResponse, PlainTextResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket

from stereocell.serve.headers import protect
from stereocell.serve.static_files import redirect

# Browsers accept __Host- with Secure and Path=/ only, and from no neighbouring host.
# Lax: a scanner's link may open the page; websockets of other sites come without the cookie.
COOKIE = "__Host-stereocell"
_ATTRIBUTES = "Path=/; Secure; HttpOnly; SameSite=Lax"


_SCAN = (
    "Scan the QR code in the terminal where this server was started. Each code works once, and the "
    "next one is shown there."
)
_PAGE = (
    '<!doctype html><html lang="en"><meta charset="utf-8"><title>StereoCell</title>'
    '<meta name="viewport" content="width=device-width, initial-scale=1">'
    '<body style="margin:10vh auto;max-width:30em;padding:0 1.5em;font:1.2em/1.5 system-ui;'
    'background:#0b0d12;color:#dfe3ea"><h1 style="font-size:1.3em">A new code is needed</h1><p>{}'
)

MAY_UPLOAD = "may_upload"  # key in a request's state: whether its client may upload to an inbox


class Gate:
    """Tokens and sessions of a server on the LAN. They end with the process."""

    def __init__(self, on_used: Callable[[], None]) -> None:
        """on_used: called after a token was used, when `token` is already the next device's."""
        self._on_used = on_used
        self._sessions: list[str] = []
        self.token = secrets.token_urlsafe(32)

    def exchange(self, token: str) -> str | None:
        """Return a new session for the token, which becomes void; None if the token is wrong."""
        if not secrets.compare_digest(token.encode(), self.token.encode()):
            return None
        self.token = secrets.token_urlsafe(32)
        self._sessions.append(secrets.token_urlsafe(32))
        self._on_used()
        return self._sessions[-1]

    def knows(self, session: str) -> bool:
        """Return whether this is a session. The time does not depend on how much of it matches."""
        found = False
        for known in self._sessions:
            found |= secrets.compare_digest(session.encode(), known.encode())
        return found


class Access:
    """ASGI middleware: answers 403 to clients without access, before the request is processed.

    It is the outermost layer: all answers get the protective headers of serve/headers.py.
    """

    def __init__(
        self,
        app: ASGIApp,
        names: Collection[str],
        gate: Gate | None,
        frames: Collection[str] = (),
        uploaders: Gate | None = None,
    ) -> None:
        """Wrap an application.

        names      hosts that this server answers to, in lower case
        gate       tokens and sessions of the LAN; None on localhost, where no session is needed
        frames     origins whose pages may hold the viewer in a frame
        uploaders  gate whose sessions may upload as well as look; None where there is no such gate
        """
        self._uploaders = uploaders
        self._app = app
        self._frames = tuple(frames)
        self._names = frozenset(names)
        self._gate = gate

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return

        async def send_protected(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = protect(message.get("headers", []), self._frames)
            await send(message)

        answer = self._judge(scope)
        if answer is None:
            await self._app(scope, receive, send_protected)
        elif scope["type"] == "http":
            await answer(scope, receive, send_protected)
        else:
            # This closes with a bare 403. uvicorn would log a false error after our own response.
            await WebSocket(scope, receive, send).close()

    def _judge(self, scope: Scope) -> Response | None:
        """Return the refusal of a request, or None if the request may pass."""
        headers = Headers(scope=scope)
        host = headers.get("host", "").lower()
        if _name(host) not in self._names:
            return PlainTextResponse("this server answers to its own names only", 403)
        is_read = scope["type"] == "websocket" or scope["method"] in ("GET", "HEAD")
        is_own = _is_own_fetch(headers, bool(self._frames), is_read=is_read)
        if not (_is_own_origin(headers, host) and is_own):
            return PlainTextResponse("pages of other origins may not use this server", 403)
        rights = scope.setdefault("state", {})
        rights[MAY_UPLOAD] = self._gate is None
        if self._gate is None:
            return None
        uploader = self._uploaders is not None and self._uploaders.knows(_cookie(headers))
        rights[MAY_UPLOAD] = uploader
        return self._judge_session(scope, headers, self._gate, is_uploader=uploader)

    def _judge_session(
        self, scope: Scope, headers: Headers, gate: Gate, *, is_uploader: bool
    ) -> Response | None:
        tokens = parse_qs(scope["query_string"].decode("latin-1")).get("token", [])
        is_known = gate.knows(_cookie(headers)) or is_uploader
        if not tokens:
            return None if is_known else _no_session(headers)
        # Only a visit uses up a token: neither a websocket nor a HEAD, which previews a link.
        if scope["type"] != "http" or scope["method"] != "GET":
            return _no_session(headers)
        if is_uploader or (is_known and self._uploaders is None):
            return redirect(scope["path"])
        session = None if self._uploaders is None else self._uploaders.exchange(tokens[0])
        if session is None and is_known:
            return redirect(scope["path"])
        if session is None:
            session = gate.exchange(tokens[0])
        if session is None:
            return _no_session(headers)
        answer = redirect(scope["path"])
        answer.headers["set-cookie"] = f"{COOKIE}={session}; {_ATTRIBUTES}"
        return answer


def _is_own_origin(headers: Headers, host: str) -> bool:
    try:
        return all(urlsplit(one.lower()).netloc == host for one in headers.getlist("origin"))
    except ValueError:
        return False


def _is_own_fetch(headers: Headers, may_be_framed: bool, *, is_read: bool) -> bool:
    """Return whether the request comes from this server's page, a followed link or no browser.

    may_be_framed  another page may hold this server's page in a frame; the browser then checks the
                   page's own policy
    is_read        the request changes nothing; another page may not send one that changes something
    """
    if headers.get("sec-fetch-site", "none") in ("none", "same-origin"):
        return True
    if not is_read:
        return False
    goes = headers.get("sec-fetch-mode"), headers.get("sec-fetch-dest")
    a_link = ("navigate", "document")  # a person followed a link on a page or in a chat
    return goes == a_link or (may_be_framed and goes == ("navigate", "iframe"))


def _name(host: str) -> str:
    """Return a Host header without its port; [::1]:80 keeps its brackets."""
    name, colon, port = host.rpartition(":")
    return name if colon and port.isdecimal() else host


def _cookie(headers: Headers) -> str:
    try:
        morsel = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
    except CookieError:
        return ""
    return "" if morsel is None else morsel.value


def _no_session(headers: Headers) -> Response:
    """Return the refusal of a client without a session: a page for a browser, else plain text."""
    never = {"Cache-Control": "no-store"}
    if "text/html" not in headers.get("accept", ""):
        return PlainTextResponse(_SCAN, 403, never)
    return HTMLResponse(_PAGE.format(_SCAN), 403, never)
