"""The requests of an inbox's page: uploads in pieces, facts and choices, builds and views.

    /                       the page; its files lie beside it
    /items, /items/ID/...   see docs/inbox.md
    /items/ID/view/         the viewer of an item, as `stereocell view` serves it at /
    /items/ID/view/live     a websocket with the state of its build; see serve/live_app.py
    /events                 a websocket with the state of all items, whenever it changes

Each refusal is one line of JSON, {"line": "..."}. A session without the right to upload may only
look.
"""

import asyncio
import json
import re
from collections.abc import Awaitable, Callable
from contextlib import suppress
from ipaddress import ip_address
from pathlib import Path
from typing import Any

import anyio.to_thread
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from stereocell.inbox.inbox import Inbox
from stereocell.inbox.item import ID, Item
from stereocell.inbox.item_build import ItemBuild
from stereocell.inbox.lines import status_of
from stereocell.inbox.preparing import view_item
from stereocell.inbox.refused import RefusedError
from stereocell.inbox.work import Work
from stereocell.live.show_source import Live
from stereocell.model.errors import StereoCellError
from stereocell.serve.access import MAY_UPLOAD
from stereocell.serve.bundle_app import built_app
from stereocell.serve.headers import policy
from stereocell.serve.limits import CLIENT_SOCKETS, MAX_CONNECTIONS
from stereocell.serve.live_app import LiveApp
from stereocell.serve.live_socket import LiveSocket
from stereocell.serve.static_files import BundleFiles

_PAGE = "inbox.html"
_OFFSET = "Upload-Offset"
_SLICE = re.compile(r"slices/[xyz]\.png")
_STATE_EVERY_S = 0.25  # s between two checks for a new state
_MAX_VIEWS = 16  # most items whose views' applications are cached; the oldest is dropped
_HEADERS = {"Cache-Control": "no-store", **policy("application/json")}
# Files of the viewer that are not served at /: there they would replace the inbox's own page.
_OF_VIEWER = ("/index.html", "/sw.js")

Handler = Callable[[Request, Item], Awaitable[Response]]


class InboxApp:
    """The application of an inbox."""

    def __init__(self, inbox: Inbox, work: Work, page: Path) -> None:
        """page: the folder of the viewer, which also holds the page of the inbox."""
        self._inbox, self._work, self._page = inbox, work, page
        self._files = BundleFiles(page, {})
        self._views: dict[str, tuple[Live | None, ASGIApp]] = {}
        self._sockets = 0
        self._live = LiveSocket(_may_upload)
        self._handlers: dict[tuple[str, str], Handler] = {
            ("PATCH", "bytes"): self._take_piece,
            ("HEAD", "bytes"): self._send_offset,
            ("GET", "understood"): self._send_understood,
            ("PUT", "choices"): self._choose,
            ("POST", "look"): self._look,
            ("POST", "build"): self._build,
            ("POST", "pause"): self._command,
            ("POST", "continue"): self._command,
            ("POST", "cancel"): self._command,
            ("DELETE", ""): self._delete,
        }

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or talk over a websocket."""
        if scope["type"] == "lifespan":
            await self._start_and_stop(receive, send)
            return
        item_id, slash, rest = _split(scope["path"])
        if scope["type"] == "websocket" and rest == "view/live":
            await self._watch(item_id, WebSocket(scope, receive, send))
        elif item_id and (rest == "view" or rest.startswith("view/")):
            await self._show(item_id, rest, scope, receive, send)
        elif scope["type"] == "websocket":
            socket = WebSocket(scope, receive, send)
            await (self._talk(socket) if scope["path"] == "/events" else socket.close())
        else:
            answer = await self._answer(Request(scope, receive), item_id, rest if slash else "")
            await answer(scope, receive, send)

    async def _answer(self, request: Request, item_id: str, rest: str) -> Response:
        try:
            return await self._answer_or_raise(request, item_id, rest)
        except StereoCellError as error:
            return JSONResponse({"line": str(error)}, status_of(error), _HEADERS)
        except ClientDisconnect:  # the client has left and reads no answer
            return Response(status_code=400)

    async def _answer_or_raise(self, request: Request, item_id: str, rest: str) -> Response:
        method, path = request.method, request.scope["path"]
        is_read = method in ("GET", "HEAD")
        if not is_read and not _may_upload(request.scope):
            raise RefusedError(403, "this session may only look: scan the code for uploading")
        if path == "/items" and method == "POST":
            return await self._announce(request)
        if not path.startswith("/items"):
            return await self._answer_file(request)
        item = self._find(item_id, request.scope)
        if is_read and _SLICE.fullmatch(rest):
            return await BundleFiles(item.folder, {}).answer(_at(request, f"/{rest}"))
        handler = self._handlers.get((method, rest))
        if handler is None:
            is_known = any(rest == name for _, name in self._handlers)
            raise RefusedError(405 if is_known else 404, "no such request: see docs/inbox.md")
        return await handler(request, item)

    def _find(self, item_id: str, scope: Scope) -> Item:
        """Return the item of a path, if the client may see it. Raises RefusedError."""
        item = self._inbox.find(item_id)
        if not _may_upload(scope) and not item.has_view:
            raise RefusedError(404, "there is no such item, or it can't be viewed yet")
        return item

    async def _answer_file(self, request: Request) -> Response:
        """Answer with a file of the page."""
        path = request.scope["path"]
        if request.method not in ("GET", "HEAD") or path in _OF_VIEWER:
            raise RefusedError(404 if path in _OF_VIEWER else 405, "no such request")
        return await self._files.answer(_at(request, f"/{_PAGE}") if path == "/" else request)

    # --- uploads

    async def _announce(self, request: Request) -> Response:
        content = await _content_of(request)
        is_local = _is_on_this_machine(request)
        item, is_new = await anyio.to_thread.run_sync(
            lambda: self._inbox.announce(content, is_local=is_local)
        )
        offset = item.upload.offset if item.upload else 0
        return _json({"id": item.id, "offset": offset}, 201 if is_new else 200)

    async def _take_piece(self, request: Request, item: Item) -> Response:
        offset = request.headers.get(_OFFSET, "")
        if not (offset.isascii() and offset.isdecimal() and len(offset) <= 18):
            raise RefusedError(400, f"{_OFFSET}: expected a whole number")
        run = anyio.to_thread.run_sync
        piece = self._inbox.piece(item, int(offset))
        try:
            write = await run(piece.__enter__)
        except RefusedError as error:
            return self._with_offset(item, error)
        try:
            with suppress(ClientDisconnect):  # bytes that arrived before the client left stay
                async for data in request.stream():
                    await run(write, data)
        except RefusedError as error:
            return self._with_offset(item, error)
        finally:
            with anyio.CancelScope(shield=True):
                await run(piece.__exit__, None, None, None)
        return self._with_offset(item, None)

    def _with_offset(self, item: Item, error: RefusedError | None) -> Response:
        headers = {**_HEADERS, _OFFSET: str(item.upload.offset if item.upload else 0)}
        if error is None:
            return Response(status_code=204, headers=headers)
        return JSONResponse({"line": str(error)}, error.status, headers)

    async def _send_offset(self, _: Request, item: Item) -> Response:
        if item.upload is None:
            raise RefusedError(410, "the upload was deleted: upload the files again")
        return Response(headers={**_HEADERS, _OFFSET: str(item.upload.offset)})

    async def _delete(self, _: Request, item: Item) -> Response:
        await anyio.to_thread.run_sync(self._inbox.delete, item)
        self._views.pop(item.id, None)
        return Response(status_code=204, headers=_HEADERS)

    # --- facts, choices and builds of an item

    async def _send_understood(self, _: Request, item: Item) -> Response:
        return _json(await anyio.to_thread.run_sync(self._inbox.understood, item))

    async def _choose(self, request: Request, item: Item) -> Response:
        content = await _content_of(request)
        await anyio.to_thread.run_sync(self._inbox.choose, item, content)
        return _json({}, 202)

    async def _look(self, _: Request, item: Item) -> Response:
        page = await anyio.to_thread.run_sync(view_item, self._inbox, item, self._page)
        return _json({"page": page})

    async def _build(self, request: Request, item: Item) -> Response:
        content = await _content_of(request, default={})
        await anyio.to_thread.run_sync(self._inbox.build, item, content)
        return _json({}, 202)

    async def _command(self, request: Request, item: Item) -> Response:
        command = request.scope["path"].rpartition("/")[2]
        await anyio.to_thread.run_sync(self._inbox.command, item, command)
        return _json({}, 202)

    # --- views

    async def _watch(self, item_id: str, socket: WebSocket) -> None:
        """Talk to one page that watches the build of an item."""
        try:
            item = self._find(item_id, socket.scope)
        except RefusedError:
            await self._live.refuse(socket)
            return
        await self._live.talk(socket, ItemBuild(self._inbox, item))

    async def _show(
        self, item_id: str, rest: str, scope: Scope, receive: Receive, send: Send
    ) -> None:
        """Pass a request on to the application of an item's view."""
        try:
            app = self._view_of(self._find(item_id, scope))
        except RefusedError as error:
            if scope["type"] == "websocket":
                await WebSocket(scope, receive, send).close()
            else:
                await PlainTextResponse(f"{error}\n", error.status, _HEADERS)(scope, receive, send)
            return
        if rest == "view" and scope["type"] == "http":
            await RedirectResponse(f"/items/{item_id}/view/", 303)(scope, receive, send)
            return
        path = rest.removeprefix("view")
        await app({**scope, "path": path, "raw_path": path.encode()}, receive, send)

    def _view_of(self, item: Item) -> ASGIApp:
        """Return the application of an item's view. Raises RefusedError if there is no view."""
        if not item.has_view:
            raise RefusedError(404, "this item has no view yet: press Look in the inbox")
        known = self._views.get(item.id)
        if known is None or known[0] is not item.live:
            live = item.live
            app = LiveApp(live, built_app) if live is not None else built_app(item.out / "bundle")
            while len(self._views) >= _MAX_VIEWS:
                del self._views[next(iter(self._views))]
            self._views[item.id] = known = live, app
        return known[1]

    # --- the state of all items

    async def _talk(self, socket: WebSocket) -> None:
        """Send one client the state of all items whenever it changes, until the client leaves."""
        await socket.accept()
        if self._sockets >= min(MAX_CONNECTIONS, 4 * CLIENT_SOCKETS):
            await socket.close(1013, "too many connections are open, try again later")
            return
        self._sockets += 1
        may_upload = _may_upload(socket.scope)
        received = asyncio.ensure_future(socket.receive())
        sent = ""
        try:
            while not received.done():
                state = await asyncio.to_thread(self._inbox.state, may_upload=may_upload)
                text = json.dumps(state)
                if text != sent:
                    await socket.send_text(text)
                    sent = text
                await asyncio.wait([received], timeout=_STATE_EVERY_S)
            if received.result()["type"] != "websocket.disconnect":
                await socket.close(1008, "this websocket takes no messages")
        except (WebSocketDisconnect, RuntimeError):  # the client has left
            pass
        finally:
            self._sockets -= 1
            received.cancel()

    async def _start_and_stop(self, receive: Receive, send: Send) -> None:
        while True:
            message = await receive()
            if message["type"] == "lifespan.startup":
                self._work.start()
                await send({"type": "lifespan.startup.complete"})
            elif message["type"] == "lifespan.shutdown":
                await asyncio.to_thread(self._work.close)
                await send({"type": "lifespan.shutdown.complete"})
                return


def _split(path: str) -> tuple[str, str, str]:
    """Return the ID, a slash and the rest of `/items/ID/rest`; all empty for other paths."""
    head, _, below = path.removeprefix("/").partition("/")
    item_id, slash, rest = below.partition("/")
    if head != "items" or not ID.fullmatch(item_id):
        return "", "", ""
    return item_id, slash, rest


def _may_upload(scope: Scope) -> bool:
    return bool(scope.get("state", {}).get(MAY_UPLOAD))


def _is_on_this_machine(request: Request) -> bool:
    """Return whether a client is on this machine."""
    with suppress(ValueError):
        return request.client is not None and ip_address(request.client.host).is_loopback
    return False


def _at(request: Request, path: str) -> Request:
    return Request({**request.scope, "path": path}, request.receive)


def _json(content: dict[str, Any], status: int = 200) -> Response:
    return JSONResponse(content, status, _HEADERS)


async def _content_of(request: Request, default: Any = None) -> Any:
    """Return the JSON of a request's body; `default` for an empty one. Raises RefusedError."""
    body = await request.body()
    if not body and default is not None:
        return default
    try:
        return await anyio.to_thread.run_sync(_parse, body)
    except (ValueError, RecursionError):
        raise RefusedError(400, "body: expected JSON") from None


def _parse(body: bytes) -> Any:
    return json.loads(body, parse_constant=_no_number)


def _no_number(_: str) -> None:
    raise ValueError
