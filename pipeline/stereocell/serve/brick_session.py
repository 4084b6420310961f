"""One client's websocket `/bricks`: it sends the bricks that the camera needs, coarse to fine.

Three tasks share a connection: one reads messages, one opens (or builds) trees, one sends. Slow
work runs in threads, so that no client waits for another's. The unacknowledged bytes never exceed
the client's window. A client that breaks the rules of docs/brick-stream.md is closed with a code
and a reason:

    1003  a binary frame                    1007  invalid UTF-8, JSON or schema
    1008  against the order or the limits   1009  a message that is too long
    1012  the bundle was replaced           1013  too many connections

serve/websocket_protocol.py closes with 1001 when the server ends, and limits single frames.
"""

import asyncio
import base64
import binascii
import json
import logging
from collections import Counter, deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from starlette.websockets import WebSocket, WebSocketDisconnect

from stereocell.formats.brick_stream import (
    BRICKS_FRAME,
    ENTRY,
    FRAME,
    TABLE_FRAME,
    VERSION,
    Frame,
    Part,
    encode_frame,
)
from stereocell.model.errors import StereoCellError
from stereocell.serve.brick_library import BrickLibrary, UnknownVolumeError
from stereocell.serve.brick_order import PlacedTree, View, order
from stereocell.serve.frame_window import FrameWindow
from stereocell.serve.limits import (
    ACK_S,
    CLIENT_SOCKETS,
    FRAME_BYTES,
    HELLO_S,
    MAX_CONNECTIONS,
    MAX_TREES,
    MESSAGE_BYTES,
    MESSAGES_PER_S,
    WINDOW_BYTES,
    Refusal,
)
from stereocell.serve.message_reader import MessageReader
from stereocell.serve.tree_files import BrickFile, FullError

_AHEAD = 2048  # bricks that are considered for one websocket frame
_LOG = logging.getLogger(__name__)
T = TypeVar("T")


class BrickEndpoint:
    """The websocket `/bricks` of a server. Its connections share threads."""

    def __init__(self) -> None:
        self._builder = ThreadPoolExecutor(1, "bricks-build")
        self._quick = ThreadPoolExecutor(2, "bricks-read")
        self._connections: Counter[str] = Counter()  # number of connections by client's address

    async def talk(self, socket: WebSocket, library: BrickLibrary) -> None:
        """Talk to one client of a library until it leaves or is closed."""
        await socket.accept()
        address = socket.client.host if socket.client else ""
        counts = self._connections
        for count, most in ((counts.total(), MAX_CONNECTIONS), (counts[address], CLIENT_SOCKETS)):
            if count >= most:
                await socket.close(1013, f"{most} connections are open, try again later")
                return
        counts[address] += 1
        try:
            await BrickSession(socket, library, self._builder, self._quick).run()
        finally:
            counts[address] -= 1
            counts += Counter()  # this addition removes entries of 0

    def close(self) -> None:
        """End the threads after the work that they are doing now; drop work that waits."""
        self._builder.shutdown(wait=False, cancel_futures=True)
        self._quick.shutdown(wait=False, cancel_futures=True)


@dataclass(slots=True)
class _Tree:
    """A tree that the client has opened. Its file may be removed meanwhile, and is then rebuilt.

    lengths  (n,), bytes of each node's brick
    sent     one byte per node: 1 if the client has its brick
    """

    tile: str
    channel: str
    table_hash: str
    placed: PlacedTree
    lengths: NDArray[np.int64]
    sent: bytearray

    @property
    def name(self) -> tuple[str, str]:
        return self.tile, self.channel


@dataclass(slots=True)
class _Running:
    """The camera view whose bricks are being sent.

    order  int64 (3, n): number of the tree, node, bytes of the brick; None until it is computed
    files  the open file of each tree that the order names, by the tree's number
    at     position in the order, up to which bricks were sent or skipped
    """

    id: int
    message: dict[str, Any]
    budget: int
    order: NDArray[np.int64] | None = None
    files: dict[int, BrickFile] | None = None
    at: int = 0
    bricks: int = 0
    bytes: int = 0


class BrickSession:
    """One connection of a client to a library."""

    def __init__(
        self,
        socket: WebSocket,
        library: BrickLibrary,
        builder: ThreadPoolExecutor,
        quick: ThreadPoolExecutor,
    ) -> None:
        self._socket = socket
        self._library = library
        self._builder = builder
        self._quick = quick
        self._window = FrameWindow()
        self._messages = MessageReader(socket)
        self._trees: list[_Tree] = []
        self._asked = 0  # trees requested on this connection
        self._to_open: asyncio.Queue[dict[str, str]] = asyncio.Queue()
        self._outbox: deque[str | Part] = deque()
        self._view: _Running | None = None
        self._wake = asyncio.Event()

    async def run(self) -> None:
        """Serve the client until it leaves or breaks a rule; then close the socket."""
        tasks = [asyncio.create_task(work) for work in (self._read(), self._open(), self._send())]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            self._library.release(self)
        errors = [error for task in done if (error := task.exception()) is not None]
        if any(isinstance(error, WebSocketDisconnect) for error in errors):
            return
        for error in errors:
            if not isinstance(error, Refusal):
                raise error
        for error in errors:
            assert isinstance(error, Refusal)
            try:
                await self._socket.close(error.code, error.reason)
            except (WebSocketDisconnect, RuntimeError):  # the client left at this moment
                return
            break

    # --- incoming messages

    async def _read(self) -> None:
        try:
            async with asyncio.timeout(HELLO_S):
                hello = await self._messages.read()
        except TimeoutError:
            raise Refusal(1008, f"no hello within {HELLO_S:g} s") from None
        if hello["type"] != "hello":
            raise Refusal(1008, f"{hello['type']} before hello")
        if hello["version"] != VERSION:
            raise Refusal(1008, f"version {hello['version']}, expected {VERSION}")
        self._window.size = int(hello.get("window", WINDOW_BYTES))
        limits = {
            "message_bytes": MESSAGE_BYTES,
            "trees": MAX_TREES,
            "messages_per_s": MESSAGES_PER_S,
            "ack_s": ACK_S,
        }
        self._queue(
            {"type": "welcome", "version": VERSION, "window": self._window.size, "limits": limits}
        )
        handlers: dict[str, Callable[[dict[str, Any]], None]] = {
            "ack": self._on_ack,
            "cancel": self._on_cancel,
            "have": self._on_have,
            "open": self._on_open,
            "view": self._on_view,
        }
        while True:
            message = await self._messages.read()
            handler = handlers.get(message["type"])
            if handler is None:
                raise Refusal(1008, "a second hello")
            handler(message)

    def _on_ack(self, message: dict[str, Any]) -> None:
        self._window.acknowledge(int(message["sequence"]))

    def _on_cancel(self, message: dict[str, Any]) -> None:
        if self._view is not None and self._view.id == int(message["id"]):
            self._finish("cancelled")

    def _on_have(self, message: dict[str, Any]) -> None:
        tree = self._trees[self._known(int(message["tree"]))]
        try:
            packed = base64.b64decode(message["nodes"], validate=True)
        except binascii.Error:
            raise Refusal(1007, "have: nodes is not base64") from None
        nodes = len(tree.lengths)
        if len(packed) != (nodes + 7) // 8:
            raise Refusal(1007, f"have: {len(packed)} bytes for {nodes} nodes")
        bits = np.unpackbits(np.frombuffer(packed, np.uint8), count=nodes, bitorder="little")
        tree.sent = bytearray(bits.tobytes())

    def _on_open(self, message: dict[str, Any]) -> None:
        self._asked += len(message["volumes"])
        if self._asked > MAX_TREES:
            raise Refusal(1008, f"more than {MAX_TREES} trees on one connection")
        for volume in message["volumes"]:
            self._to_open.put_nowait(volume)

    def _on_view(self, message: dict[str, Any]) -> None:
        for number in message["trees"]:
            self._known(int(number))
        if self._view is not None:
            self._finish("cancelled")
        self._view = _Running(int(message["id"]), message, int(message["budget"]))
        self._wake.set()

    def _known(self, number: int) -> int:
        if number >= len(self._trees):
            raise Refusal(1008, f"tree {number} is not open")
        return number

    # --- trees

    async def _open(self) -> None:
        while True:
            wanted = await self._to_open.get()
            tile, channel = wanted["tile"], wanted["channel"]
            try:
                there = partial(self._library.open_built, tile, channel)
                file = await self._in(self._quick, there)
                if file is None:
                    file = await self._in(self._builder, partial(self._library.open, tile, channel))
            except UnknownVolumeError as error:
                self._report(wanted, "unknown", str(error))
                continue
            except FullError as error:
                self._report(wanted, "full", "the server has no room for this volume now")
                _LOG.error("%s", error)
                continue
            except (StereoCellError, OSError) as error:
                _LOG.error("%s", error)  # only for this machine's user: the text may name folders
                self._report(wanted, "damaged", "can't be read: see the server's terminal")
                continue
            table = file.table
            number = len(self._trees)
            lengths = table.nodes["length"].astype(np.int64)
            sent = bytearray(len(lengths))
            self._trees.append(_Tree(tile, channel, file.table_hash, file.placed, lengths, sent))
            follows = wanted.get("table") != file.table_hash
            self._queue(_describe(number, wanted, file, table_follows=follows))
            if follows:
                for at in range(0, table.bytes, FRAME_BYTES):
                    part = file.table_bytes[at : at + FRAME_BYTES]
                    self._outbox.append(Part(number, at, part))

    # --- outgoing messages

    async def _send(self) -> None:
        while True:
            if self._outbox:
                item = self._outbox.popleft()
                if isinstance(item, str):
                    await self._socket.send_text(item)
                else:
                    frame = Frame(TABLE_FRAME, self._window.sequence + 1, 0, (item,))
                    await self._push(await self._in(self._quick, partial(encode_frame, frame)))
            elif self._view is None:
                self._wake.clear()
                await self._wake.wait()
            elif self._view.order is None:
                await self._plan(self._view)
            else:
                await self._send_batch(self._view)

    async def _plan(self, view: _Running) -> None:
        trees = {int(number): self._trees[int(number)] for number in view.message["trees"]}
        found = await self._in(self._quick, partial(_find_order, view.message, trees))
        needed = [number for number in trees if (found[0] == number).any()]
        names = [trees[number].name for number in needed]
        try:
            await self._in(self._quick, partial(self._library.hold, self, names))
            files = {number: await self._file(trees[number]) for number in needed}
        except (StereoCellError, OSError) as error:
            _LOG.error("%s", error)
            raise Refusal(1012, "the bundle was replaced: connect again") from None
        view.files, view.order = files, found

    async def _file(self, tree: _Tree) -> BrickFile:
        """Return a tree's file; rebuild it if it was removed meanwhile."""
        file = await self._in(self._quick, partial(self._library.open_built, *tree.name))
        if file is None:
            file = await self._in(self._builder, partial(self._library.open, *tree.name))
        if file.table_hash != tree.table_hash:
            raise StereoCellError(
                f"tile {tree.tile}, channel {tree.channel}: the volume was replaced"
            )
        return file

    async def _send_batch(self, view: _Running) -> None:
        order, files = view.order, view.files
        assert order is not None
        assert files is not None
        picked, spent, length, at = [], 0, FRAME.size, view.at
        is_over = False
        for tree, node, size in order[:, at : at + _AHEAD].T.tolist():
            if not self._trees[tree].sent[node]:
                is_over = view.bytes + spent + size > view.budget
                if is_over or length + ENTRY.size + size > FRAME_BYTES:
                    break
                picked.append((tree, node))
                spent += size
                length += ENTRY.size + size
            at += 1
        if not picked:
            view.at = at
            if is_over or at == order.shape[1]:
                self._finish("budget" if is_over else "complete")
            return

        def work() -> bytes:
            parts = [Part(t, n, files[t].read([n])[0]) for t, n in picked]
            return encode_frame(
                Frame(BRICKS_FRAME, self._window.sequence + 1, view.id, tuple(parts))
            )

        data = await self._in(self._quick, work)
        await self._window.wait_for_room(len(data))
        if self._view is not view:  # the view ended meanwhile, and its `done` is queued
            return
        view.at = at
        view.bricks += len(picked)
        view.bytes += spent
        for tree, node in picked:
            self._trees[tree].sent[node] = 1
        await self._push(data)

    async def _push(self, data: bytes) -> None:
        """Send a binary frame, which carries the next sequence number, as soon as it fits."""
        await self._window.wait_for_room(len(data))
        self._window.add(len(data))
        await self._socket.send_bytes(data)

    def _finish(self, reason: str) -> None:
        view = self._view
        assert view is not None
        self._view = None
        self._library.release(self)
        counts = {"bricks": view.bricks, "bytes": view.bytes}
        self._queue({"type": "done", "view": view.id, "reason": reason, **counts})

    def _report(self, volume: dict[str, str], code: str, message: str) -> None:
        place = {"tile": volume["tile"], "channel": volume["channel"]}
        self._queue({"type": "error", "code": code, "message": message, **place})

    def _queue(self, message: dict[str, Any]) -> None:
        self._outbox.append(json.dumps(message))
        self._wake.set()

    async def _in(self, threads: ThreadPoolExecutor, work: Callable[[], T]) -> T:
        return await asyncio.get_running_loop().run_in_executor(threads, work)


def _describe(
    number: int, volume: dict[str, str], file: BrickFile, *, table_follows: bool
) -> dict[str, Any]:
    """Return the message that tells the client that a tree is open."""
    table = file.table
    return {
        "type": "tree",
        "tree": number,
        "tile": volume["tile"],
        "channel": volume["channel"],
        "source": file.volume.source,
        "table": file.table_hash,
        "table_bytes": table.bytes,
        "table_follows": table_follows,
        "nodes": len(table.nodes),
        "bricks": int(np.count_nonzero(table.nodes["length"])),
        "brick_bytes": table.brick_bytes,
    }


def _find_order(message: dict[str, Any], trees: dict[int, _Tree]) -> NDArray[np.int64]:
    """Return int64 (3, n): number of the tree, node, bytes of the bricks that a view lacks."""

    def vector(key: str) -> NDArray[np.float64]:
        return np.array(message[key], dtype=np.float64)

    view = View(
        vector("clip").reshape(4, 4).T,
        vector("eye"),
        vector("gaze"),
        float(message["pixels_per_radian"]),
        float(message["texel_px"]),
        float(message.get("error_grey", 0.0)),
    )
    numbers = list(trees)
    tree, node, _ = order(view, [trees[number].placed for number in numbers])
    sizes, is_sent = np.zeros(len(node), dtype=np.int64), np.zeros(len(node), dtype=np.bool_)
    for i, number in enumerate(numbers):
        here = tree == i
        sizes[here] = trees[number].lengths[node[here]]
        is_sent[here] = np.frombuffer(trees[number].sent, np.uint8)[node[here]] != 0
    return np.stack([np.array(numbers)[tree], node, sizes])[:, ~is_sent]
