"""The widget: the viewer's page in a frame, a state shared with the kernel, and a lasting picture.

The page requests files by messages of the widget, which the kernel answers. It thus works wherever
widgets do, without a server, a port or an address. The kernel answers when no cell is running.
"""

import base64
import secrets
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import anywidget
import traitlets
from IPython.display import display, update_display

from stereocell.bundle import blob_page
from stereocell.notebook import page
from stereocell.notebook.bundle_files import NotebookBundle
from stereocell.notebook.picture import Appearances, no_picture
from stereocell.notebook.shared_state import (
    check_channels,
    check_link,
    check_picked,
    check_view,
)

_HERE = Path(__file__).parent
_PNG = b"\x89PNG\r\n\x1a\n"
_MAX_PICTURE = 4 * 2**20  # bytes, largest picture; larger ones make a notebook slow to open
_VIEW = "application/vnd.jupyter.widget-view+json"


class Viewer(anywidget.AnyWidget):
    """The viewer in a notebook. Its state can be set, and observed like any trait.

    link      the whole view, as the part of a link from `#` on
    channels  `visible`, `color` (#rrggbb), `opacity` (0..1) and `window` (the source's values) of
              channels, by ID; may be set by name, too. Values that are left out do not change
    view      `eye_um` and `target_um` of the camera: x, y, z of the world in um
    picked    the point that was tapped last: `point_um`, `tile`, `channel`, `object` (number in a
              label map); or None. A point that is set gets a mark
    height    height of the viewer, CSS pixels
    quality   a sentence on how an array was reduced, or empty
    notes     the text that the build printed
    """

    _esm = (_HERE / "widget.js").read_text("utf-8")
    _css = (_HERE / "widget.css").read_text("utf-8")

    name = traitlets.Unicode(read_only=True).tag(sync=True)
    quality = traitlets.Unicode(read_only=True).tag(sync=True)
    height = traitlets.Int(520, min=120, max=4000).tag(sync=True)
    link = traitlets.Unicode().tag(sync=True)
    channels = traitlets.Dict().tag(sync=True)
    view = traitlets.Dict().tag(sync=True)
    picked = traitlets.Dict(allow_none=True, default_value=None).tag(sync=True)
    _page = traitlets.Unicode().tag(sync=True)
    _bundle = traitlets.Unicode().tag(sync=True)
    _picture = traitlets.Bytes().tag(sync=True)

    def __init__(
        self,
        bundle: NotebookBundle,
        *,
        quality: str = "",
        notes: str = "",
        draw: Callable[[Appearances], bytes] = no_picture,
        height: int = 520,
    ) -> None:
        """Make a viewer of a bundle.

        draw  returns a PNG of the specimen with the channels' appearances, for a notebook that no
              browser has opened; empty if no picture can be drawn
        """
        self._files = bundle
        self._draw = draw
        self._display_id = ""
        self._is_from_page = False
        self.notes = notes
        super().__init__(height=height, _page=page.key(), _bundle=secrets.token_hex(8))
        self.set_trait("name", bundle.name)
        self.set_trait("quality", quality)
        self.on_msg(self._answer)

    @property
    def told(self) -> str:
        """The earlier name of `notes`."""
        return self.notes

    def set_channel(self, channel: str, **look: Any) -> None:
        """Set some of a channel's `visible`, `color`, `opacity` and `window`; the others stay."""
        id_ = self._files.ids.get(channel, channel)
        self.channels = {**self.channels, id_: {**self.channels.get(id_, {}), **look}}

    # --- the notebook's side

    def _ipython_display_(self, **_: Any) -> None:
        """Display the viewer, and its picture below it, which a live viewer hides.

        The picture is an output of its own for two reasons. JupyterLab shows no picture in an
        output that held a widget, and it restarts an output whose picture changes.
        """
        if not self._picture:
            self._picture = self._draw(self.channels)
        view = {"version_major": 2, "version_minor": 0, "model_id": self.model_id}
        display({"text/plain": f"StereoCell: {self.name}", _VIEW: view}, raw=True)
        self._display_id = secrets.token_hex(8)
        shown = self._shown()
        display(shown["obj"], metadata=shown["metadata"], raw=True, display_id=self._display_id)

    def _shown(self) -> dict[str, Any]:
        """Return the picture as the arguments of an output."""
        data = {"text/plain": ""}
        if self._picture:
            data["image/png"] = base64.b64encode(self._picture).decode()
        about = {"image/png": {"alt": f"StereoCell: {self.name}"}} if self._picture else {}
        return {"obj": data, "metadata": about}

    # --- the page's side

    def set_state(self, sync_data: dict[str, Any]) -> None:
        """Take over the state that the page sends."""
        self._is_from_page = True
        try:
            super().set_state(sync_data)
        finally:
            self._is_from_page = False

    def _answer(self, _: Any, content: Any, buffers: Any) -> None:
        """Answer a request of the page, or take over its picture."""
        if not isinstance(content, Mapping):
            return
        about = {"id": content.get("id")}
        match content.get("ask"):
            case "page":
                files = blob_page.files()
                answer = {**about, "html": page.document(), "names": list(files)}
                self.send(answer, list(files.values()))
            case "file":
                status, found = self._files.answer(content.get("path"), header=content.get("range"))
                self.send({**about, "status": status}, [found])
            case "picture":
                png = bytes(buffers[0]) if buffers else b""
                if png.startswith(_PNG) and len(png) <= _MAX_PICTURE:
                    self._picture = png
                    if self._display_id:
                        update_display(**self._shown(), raw=True, display_id=self._display_id)

    # --- checks of the state that is set

    @traitlets.validate("link")
    def _check_link(self, proposal: Any) -> Any:
        return check_link(proposal["value"])

    @traitlets.validate("channels")
    def _check_channels(self, proposal: Any) -> Any:
        return check_channels(proposal["value"], self._files.ids)

    @traitlets.validate("view")
    def _check_view(self, proposal: Any) -> Any:
        return check_view(proposal["value"])

    @traitlets.validate("picked")
    def _check_picked(self, proposal: Any) -> Any:
        return check_picked(proposal["value"])

    @traitlets.observe("link")
    def _reset(self, _: Any) -> None:
        """Clear the other state when a notebook sets a link, since a link is a whole view."""
        if not self._is_from_page:
            self.channels, self.view = {}, {}
            self.set_trait("picked", None)
