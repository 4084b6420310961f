"""Serve an inbox: `stereocell serve --inbox`.

Without `--lan`, every client of this machine may upload. With `--lan`, the server prints two codes:
one admits devices that upload and look, the other admits devices that only look.
"""

from pathlib import Path

from starlette.types import ASGIApp

from stereocell.inbox.builds import MakeBuild
from stereocell.inbox.inbox import Inbox
from stereocell.inbox.limits import InboxLimits
from stereocell.inbox.work import Work
from stereocell.model.errors import OutputError
from stereocell.serve.access import MAY_UPLOAD, Access, Gate
from stereocell.serve.inbox_app import InboxApp
from stereocell.serve.inbox_protocol import InboxHttp
from stereocell.serve.server import Server, run_until_stopped
from stereocell.storage.assets import viewer_dist
from stereocell.storage.lock import alone_in

_UPLOADING = "For a device that uploads, and looks:\n"
_VIEWING = "For a device that only looks:\n"


class InboxServer(Server):
    """A server of an inbox."""

    def __init__(
        self,
        folder: Path,
        limits: InboxLimits,
        make_build: MakeBuild,
        *,
        port: int,
        lan: bool,
        for_program: bool = False,
    ) -> None:
        """Raises OutputError if the folder holds other files than an inbox's; see also `Server`."""
        page = viewer_dist()
        if page is None:
            raise OutputError("the viewer is not built: run `make setup`")
        self.folder = folder
        self.inbox = Inbox(folder, limits)
        self.uploaders = Gate(self._invite_uploader) if lan else None
        app = InboxApp(self.inbox, Work(self.inbox, page, make_build), page)

        def make(names: tuple[str, ...], gate: Gate | None) -> ASGIApp:
            return Access(app, names, gate, (), self.uploaders)

        super().__init__(port, lan, make, for_program=for_program, http=InboxHttp)

    def introduce(self) -> None:
        """Print the address, and with `--lan` the code for uploading."""
        self.introduce_as(f"the inbox {self.folder}", {"inbox": str(self.folder)})
        self._invite_uploader()

    def invite(self) -> None:
        """Print the QR code that admits a device that may only look, not upload."""
        if self.gate is not None:
            self.invite_by(self.gate, _VIEWING, {MAY_UPLOAD: False})

    def _invite_uploader(self) -> None:
        if self.uploaders is not None:
            self.invite_by(self.uploaders, _UPLOADING, {MAY_UPLOAD: True})


def serve_inbox(
    folder: Path,
    limits: InboxLimits,
    make_build: MakeBuild,
    *,
    port: int,
    lan: bool,
    open_browser: bool,
    for_program: bool,
) -> None:
    """Serve an inbox until Ctrl+C or SIGTERM; create its folder if it is missing.

    Raises StereoCellError if the folder holds other files, or another server serves it.
    """
    with alone_in(folder, "serve"):
        server = InboxServer(
            folder.absolute(), limits, make_build, port=port, lan=lan, for_program=for_program
        )
        run_until_stopped(server, open_browser=open_browser)
