"""Serve a source while it is built: `/live`, the views in folders of their own, and the bundle.

    /               the page and the first view; a request for one of its files waits until the
                    file is written; once the build has a bundle, the bundle with bricks and values
    /manifest.json  the newest view's manifest; the header Stereocell-Live names the view's folder
    /g1/, /g2/      later views, which show surfaces wherever a tile is finished
    /bricks         a websocket with the bricks of the first view, which are made from the source;
                    a later view's bricks are at /g1/bricks
    /reading        the share of the source that has been read for the first view: {"share": 0.4}
    /live           a websocket that sends the state of the build and takes commands

The server sends the state whenever it changes, at most four times a second: see
`live/build_state.py`.

    {"doing": "building", "label": "units", "done": 3, "total": 20, "tiles": 1, "share": 0.41,
     "left_s": 38.5, "folder": "g1/", "has_bundle": false, "line": "", "all_tiles": 10, "place": 0,
     "may_continue": true, "may_control": true}

A client may send `pause`, `continue` or `cancel` as text. It may also send `late` if its frames are
late; the build then rests for a moment. Only clients of this machine may send commands: a phone on
the LAN that watches can't stop the build, and its state has no line of an error. For an inbox's
build, the clients that may upload may also send commands.
"""

import asyncio
from collections.abc import Callable
from pathlib import Path

from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocket

from stereocell.bundle.manifest import MANIFEST
from stereocell.live.show_source import Live
from stereocell.model.errors import StereoCellError
from stereocell.serve.brick_library import BrickLibrary
from stereocell.serve.brick_session import BrickEndpoint
from stereocell.serve.headers import policy
from stereocell.serve.live_bricks import LiveBricks
from stereocell.serve.live_socket import LiveSocket, is_on_this_machine
from stereocell.serve.static_files import BundleFiles, bricks_header

LIVE_HEADER = "Stereocell-Live"
READING = "stereocell-reading"  # Server-Timing of the page while `/reading` reports a share below 1
_NOW = {"Cache-Control": "no-store", **policy("application/json")}


class LiveApp:
    """The application that shows a source while its bundle is being built."""

    def __init__(self, live: Live, built: Callable[[Path], ASGIApp]) -> None:
        """built: returns the application that serves a whole bundle."""
        self._live, self._build, self._make_built = live, live.build, built
        self._built: ASGIApp | None = None
        self._bricks = (
            None if live.fine is None else LiveBricks(live.fine, live.bundle.parent, live.build)
        )
        self._endpoint = BrickEndpoint()
        self._socket = LiveSocket(is_on_this_machine)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or talk over a websocket."""
        if scope["type"] == "lifespan":
            await self._start_and_stop(receive, send)
        elif scope["type"] == "websocket" and scope["path"] == "/live":
            await self._talk(WebSocket(scope, receive, send))
        elif (app := self._find_built()) is not None and self._folder_of(scope) is None:
            await app(scope, receive, send)
        elif scope["type"] == "websocket":
            await self._send_bricks(WebSocket(scope, receive, send))
        else:
            await self._answer(scope, receive, send)

    def _find_built(self) -> ASGIApp | None:
        bundle = None if self._build is None else self._build.bundle
        if self._built is None and bundle is not None:
            self._built = self._make_built(bundle)
        return self._built

    def _folder_of(self, scope: Scope) -> Path | None:
        """Return the folder of the later view that a path names; None if it names no later view."""
        if self._build is None:
            return None
        return self._build.find_view(_first_of(scope["path"]))

    async def _send_bricks(self, socket: WebSocket) -> None:
        """Talk to one client that requests the bricks of a view."""
        folder = self._folder_of(socket.scope)
        path = "/bricks" if folder is None else f"/{_first_of(socket.scope['path'])}/bricks"
        library = self._library(folder)
        if socket.scope["path"] != path or not self._live.first.done() or library is None:
            await socket.close()
            return
        await self._endpoint.talk(socket, library)

    def _library(self, folder: Path | None) -> BrickLibrary | None:
        """Return the bricks of a later view, or of the first one if `folder` is None.

        Returns None if the source can't be read tile by tile: its views then stay coarse.
        """
        if self._bricks is None:
            return None
        if folder is None or self._build is None:
            return self._bricks.library(self._live.bundle, {})
        return self._bricks.library(folder, self._build.holders)

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer with a file of a view, or with the share that has been read."""
        if scope["method"] not in ("GET", "HEAD"):
            await PlainTextResponse("expected GET", 405)(scope, receive, send)
            return
        path, folder, headers = scope["path"].lstrip("/"), self._folder_of(scope), {}
        if path == "reading":
            about = {"share": 1.0 if self._live.first.done() else self._live.reading.share}
            await JSONResponse(about, headers=_NOW)(scope, receive, send)
            return
        if folder is not None:
            path = path.partition("/")[2]
        elif path == MANIFEST and self._build is not None:
            newest = self._build.state.folder
            folder = self._build.find_view(newest.rstrip("/"))
            headers = {LIVE_HEADER: f"version=1; folder={newest if folder else ''}"}
        answer = await self._file(folder, path, headers, scope, receive)
        await answer(scope, receive, send)

    async def _file(
        self,
        folder: Path | None,
        path: str,
        headers: dict[str, str],
        scope: Scope,
        receive: Receive,
    ) -> Response:
        """Return a file of a later view; if `folder` is None, of the page or the first view."""
        request = Request({**scope, "path": f"/{path}"}, receive)
        if folder is None:
            page_file = await BundleFiles(self._live.page, {}).answer(request)
            if page_file.status_code != 404:
                if not self._live.first.done():
                    page_file.headers["Server-Timing"] = READING
                return page_file
            try:
                await asyncio.shield(asyncio.wrap_future(self._live.first))
            except StereoCellError:  # the command prints the error and ends
                return PlainTextResponse("the source can't be shown: see the terminal", 503)
        library = self._library(folder) if path == MANIFEST else None
        if library is not None and library.has_finer():
            headers = headers | bricks_header("" if folder is None else f"{folder.name}/")
        return await BundleFiles(folder or self._live.bundle, headers).answer(request)

    async def _talk(self, socket: WebSocket) -> None:
        if self._build is None:
            await socket.close()
        else:
            await self._socket.talk(socket, self._build)

    async def _start_and_stop(self, receive: Receive, send: Send) -> None:
        while True:
            message = await receive()
            if message["type"] == "lifespan.startup":
                await send({"type": "lifespan.startup.complete"})
            elif message["type"] == "lifespan.shutdown":
                self._endpoint.close()
                await send({"type": "lifespan.shutdown.complete"})
                return


def _first_of(path: str) -> str:
    """Return the first name in a path, such as `g1` of `/g1/bricks`."""
    return path.lstrip("/").partition("/")[0]
