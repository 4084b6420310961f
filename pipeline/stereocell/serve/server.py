"""Serve a built bundle and its bricks: `stereocell view` and `stereocell serve`.

A static bundle works on any web host. This server adds three things to it. It answers byte ranges
of files. Its websocket `/bricks` sends the parts of volumes that a camera needs
(serve/brick_session.py). `/values` returns measured values from the stage beside the bundle
(serve/measured_values.py).

The server listens on localhost. With `--lan` it serves the network, over TLS, and only devices that
were admitted by a token (serve/access.py). It logs only faults of the program and of the bundle. It
logs no requests, hence neither tokens nor names that a client sent. docs/server.md lists the
requests that the other modules refuse.
"""

import json
import logging
import os
import signal
import socket
import ssl
import sys
import webbrowser
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import uvicorn
from starlette.types import ASGIApp

from stereocell.bundle.manifest import MANIFEST, read_manifest
from stereocell.model.errors import StereoCellError
from stereocell.serve.access import Gate
from stereocell.serve.brick_library import BrickLibrary
from stereocell.serve.bundle_app import make_app
from stereocell.serve.http_protocol import GuardedHttp
from stereocell.serve.lan import draw_qr, explain, find_addresses, find_names, make_certificate
from stereocell.serve.lifetime import Lifetime
from stereocell.serve.limits import MESSAGE_BYTES, STOP_S
from stereocell.serve.static_files import ShrunkError
from stereocell.serve.websocket_protocol import GuardedSocket

if TYPE_CHECKING:
    from stereocell.live.show_source import Live

LOCALHOST = "127.0.0.1"
_OWN_NAMES = (LOCALHOST, "localhost")  # hosts; any port is accepted, since a tunnel may change it


def serve(
    out: Path,
    port: int,
    *,
    lan: bool,
    open_browser: bool,
    for_program: bool = False,
    frames: tuple[str, ...] = (),
    live: "Live | None" = None,
) -> None:
    """Serve OUT/bundle until Ctrl+C or SIGTERM. OUT may be a bundle. Port 0 takes any free port.

    for_program  print lines of JSON instead of texts for a person: first the address, then, with
                 `lan`, an address that admits one device, and a new one after each admission
    frames       origins whose pages may hold the viewer in a frame
    live         a source whose first view is the bundle, and is still being written; None if the
                 bundle is finished

    Returns when the running transfers have finished, or STOP_S later. Raises KeyboardInterrupt at
    once at a second Ctrl+C. Raises StereoCellError if there is no bundle, its manifest was changed,
    the port is taken, or there is no network.
    """
    bundle, _ = _places(out)
    if (bundle / MANIFEST).is_file():
        read_manifest(bundle)  # this raises if the manifest was changed
    server = BundleServer(out, port, lan, for_program, frames, live)
    if live is not None:
        live.first.add_done_callback(lambda first: _stop_after(first, server))
    run_until_stopped(server, open_browser=open_browser)


def run_until_stopped(server: "Server", *, open_browser: bool) -> None:
    """Print a server's address and run it until Ctrl+C or SIGTERM.

    Raises KeyboardInterrupt at a second Ctrl+C.
    """
    # While uvicorn runs, it handles SIGTERM itself: it ends, then raises the signal again. This
    # handler receives that signal, and an earlier SIGTERM.
    before = signal.signal(signal.SIGTERM, lambda *_: server.stop())
    try:
        server.introduce()
        server.invite()
        if open_browser:
            webbrowser.open(server.address)
        with suppress(KeyboardInterrupt):
            server.run()
    finally:
        signal.signal(signal.SIGTERM, before)
    if server.was_forced:
        raise KeyboardInterrupt


def _places(out: Path) -> tuple[Path, Path | None]:
    """Return the folders of a bundle and of its brick trees; OUT may be a bundle itself.

    The second is None for a bundle outside a build: nothing may be written beside it.
    """
    if (out / "bundle").exists() or not (out / MANIFEST).is_file():
        return out / "bundle", out / "bricks"
    holder = Path(os.path.abspath(out)).parent
    is_of_build = (holder / "bundle" / MANIFEST).is_file() and (holder / "plan.json").is_file()
    if is_of_build and os.path.samefile(holder / "bundle", out):
        return out, holder / "bricks"
    return out, None


MakeApp = Callable[[tuple[str, ...], Gate | None], ASGIApp]


class Server:
    """A server that is bound to `address`; run() answers requests until stop()."""

    def __init__(
        self,
        port: int,
        lan: bool,
        make: MakeApp,
        *,
        for_program: bool = False,
        http: type[GuardedHttp] = GuardedHttp,
    ) -> None:
        """Bind a server.

        make  returns the application for the server's names and, on the LAN, its gate

        Raises StereoCellError if the port is taken, or there is no network.
        """
        self.for_program = for_program
        names: tuple[str, ...] = _OWN_NAMES
        self.gate: Gate | None = None
        self.fingerprint = ""
        context: ssl.SSLContext | None = None
        host, scheme = "localhost", "http"
        if lan:
            addresses = find_addresses()
            names = tuple(find_names(addresses))
            context, self.fingerprint = make_certificate(names)
            self.gate = Gate(self.invite)
            host, scheme = addresses[0], "https"
        self._socket = _bind("0.0.0.0" if lan else LOCALHOST, port)
        self.port: int = self._socket.getsockname()[1]
        self.address = f"{scheme}://{host}:{self.port}/"
        config = uvicorn.Config(
            make(names, self.gate),
            log_config=None,
            log_level="error",
            access_log=False,
            server_header=False,
            http=http,
            ws=GuardedSocket,
            ws_max_size=MESSAGE_BYTES,
            ws_per_message_deflate=False,  # bricks are compressed already
        )
        logging.getLogger("uvicorn.error").addFilter(_is_ours)
        self._server = Lifetime(config, context, self._print_wait)

    @property
    def has_started(self) -> bool:
        """Whether the server answers requests."""
        return self._server.started

    @property
    def was_forced(self) -> bool:
        """Whether a second Ctrl+C ended the server before its transfers had finished."""
        return self._server.force_exit

    def introduce(self) -> None:
        """Print the address and the content that it shows."""
        self.introduce_as("the content of this server", {})

    def introduce_as(self, shown: str, about: Mapping[str, object]) -> None:
        """Print the address with the words `shown`, or for a program with the values `about`."""
        if self.for_program:
            print_json({"address": self.address, **about, "fingerprint": self.fingerprint})
        else:
            print(f"{self.address} shows {shown}; Ctrl+C ends it", flush=True)

    def invite(self) -> None:
        """Print the QR code for the next device on the LAN, and explain the device's warning."""
        if self.gate is not None:
            self.invite_by(self.gate, "", {})

    def invite_by(self, gate: Gate, title: str, about: Mapping[str, object]) -> None:
        """Print the QR code of a gate under a title, or for a program with the values `about`."""
        invitation = f"{self.address}?token={gate.token}"
        if self.for_program:
            print_json({"invitation": invitation, **about})
            return
        code = draw_qr(invitation, encoding=sys.stdout.encoding or "utf-8")
        print(title + explain(self.address, self.fingerprint, code), flush=True)

    def _print_wait(self, transfers: int) -> None:
        print(
            f"finishing {transfers} transfer{'s' * (transfers > 1)}, at most {STOP_S:g} s; "
            "Ctrl+C again stops at once",
            file=sys.stderr if self.for_program else sys.stdout,
            flush=True,
        )

    def run(self) -> None:
        """Answer requests until stop(), or a signal in the main thread."""
        try:
            self._server.run(sockets=[self._socket])
        finally:
            self._socket.close()

    def stop(self) -> None:
        """Make run() end soon. Any thread may call this."""
        self._server.should_exit = True


class BundleServer(Server):
    """A server of a bundle, or of the views of a source while it is built."""

    def __init__(
        self,
        out: Path,
        port: int,
        lan: bool,
        for_program: bool = False,
        frames: tuple[str, ...] = (),
        live: "Live | None" = None,
    ) -> None:
        """Raises StereoCellError if there is no bundle or network, or the port is taken."""
        bundle, bricks = _places(out) if live is None else (live.bundle, None)
        library = stage = None
        if bricks is not None:
            library, stage = BrickLibrary(bundle, bricks), bricks.parent / "stage"
        self.bundle, self.has_bricks = bundle, bricks is not None
        self._live = live
        if live is None and not out.exists():
            raise StereoCellError(
                f"{out}: not found, expected a build, a bundle, or a source (a file, a folder, or "
                "an address that begins with https:// or s3://)"
            )
        for name in (MANIFEST, "index.html"):
            if live is None and not (bundle / name).is_file():
                raise StereoCellError(
                    f"{bundle / name}: not found, expected a built bundle: run "
                    "`stereocell bundle OUT` to write it"
                )

        def make(names: tuple[str, ...], gate: Gate | None) -> ASGIApp:
            return make_app(
                bundle, library, stage, names=names, gate=gate, frames=frames, live=live
            )

        super().__init__(port, lan, make, for_program=for_program)

    def introduce(self) -> None:
        """Print the address, and the path of the bundle or, while a source is built, of OUT."""
        if self._live is not None:
            self._introduce_source(self._live)
            return
        shown = str(self.bundle)
        if not self.has_bricks:
            shown += " (a bundle without its build: volumes are sent whole)"
        self.introduce_as(shown, {"bundle": str(self.bundle), "bricks": self.has_bricks})

    def _introduce_source(self, live: "Live") -> None:
        about: dict[str, object] = {"bricks": live.fine is not None}
        if live.build is None:
            self.introduce_as("the source without building it", about)
        else:
            about |= {"out": str(live.build.out)}
            self.introduce_as("the source and, as it is built, its surfaces", about)


def _stop_after(first: "Future[None]", server: BundleServer) -> None:
    """Stop a server whose first view could not be made."""
    if first.exception() is not None:
        server.stop()


def print_json(content: Mapping[str, object]) -> None:
    """Print a line of JSON for a program."""
    print(json.dumps(content), flush=True)


def _bind(host: str, port: int) -> socket.socket:
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        if sys.platform != "win32":  # with SO_REUSEADDR, Windows would share a port that is in use
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((host, port))
        listener.listen(128)
    except (OSError, OverflowError) as error:
        listener.close()
        reason = (error.strerror or error) if isinstance(error, OSError) else error
        raise StereoCellError(
            f"port {port}: {reason}; choose another by --port, or --port 0 for a free one"
        ) from error
    return listener


def _is_ours(record: logging.LogRecord) -> bool:
    """Return whether to log a record: not the traceback of a client's invalid frame.

    That client was closed with a code. The traceback of a file that shrank while it was sent
    becomes one line.
    """
    fault = record.exc_info[1] if record.exc_info else None
    if isinstance(fault, ShrunkError):
        record.msg, record.args, record.exc_info = str(fault), (), None
    return not isinstance(fault, UnicodeDecodeError)
