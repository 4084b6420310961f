"""The widget: the viewer's page in a frame, its state in both directions, its picture for good.

The kernel answers what the page asks for by messages of the widget, so that it works wherever
widgets do: no port, no server, no address. The page asks between two cells, when the kernel rests.
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
from stereocell.notebook.picture import Looks, no_picture
from stereocell.notebook.shared_state import (
    check_channels,
    check_link,
    check_picked,
    check_view,
)

_HERE = Path(__file__).parent
_PNG = b"\x89PNG\r\n\x1a\n"
_MAX_PICTURE = 4 * 2**20  # bytes: a notebook with larger ones is slow to open
_VIEW = "application/vnd.jupyter.widget-view+json"


class Viewer(anywidget.AnyWidget):
    """The viewer in a notebook. Its state may be set, and observed as any trait.

    link      the whole view, as behind `#` in links to it
    channels  by ID, or by name where they are set: `visible`, `color` (#rrggbb), `opacity` (0..1),
              `window` (the source's values); what is left out stays as it is
    view      `eye_um` and `target_um`: from where the specimen is seen, x, y, z of the world in um
    picked    what was tapped last: `point_um`, `tile`, `channel`, `object` (its number in a label
              map); None: nothing was. One that is set is marked
    height    CSS pixels
    quality   in words: of what the picture is, and why
    told      what the build said
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
        told: str = "",
        draw: Callable[[Looks], bytes] = no_picture,
        height: int = 520,
    ) -> None:
        """
        draw  returns a PNG of the specimen by the channels' looks, for a notebook that no browser
              has opened; empty: none can be drawn
        """
        self._files = bundle
        self._draw = draw
        self._display_id = ""
        self._is_told = False
        self.told = told
        super().__init__(height=height, _page=page.key(), _bundle=secrets.token_hex(8))
        self.set_trait("name", bundle.name)
        self.set_trait("quality", quality)
        self.on_msg(self._hear)

    def set_channel(self, channel: str, **look: Any) -> None:
        """Set some of a channel's `visible`, `color`, `opacity`, `window`; others stay."""
        id_ = self._files.ids.get(channel, channel)
        self.channels = {**self.channels, id_: {**self.channels.get(id_, {}), **look}}

    # --- the notebook's side

    def _ipython_display_(self, **_: Any) -> None:
        """Show the viewer, and below it its picture, by itself: the viewer hides it while it lives.

        JupyterLab shows no picture of an output that was a widget's, and begins an output anew that
        is given another picture.
        """
        if not self._picture:
            self._picture = self._draw(self.channels)
        view = {"version_major": 2, "version_minor": 0, "model_id": self.model_id}
        display({"text/plain": f"StereoCell: {self.name}", _VIEW: view}, raw=True)
        self._display_id = secrets.token_hex(8)
        shown = self._shown()
        display(shown["obj"], metadata=shown["metadata"], raw=True, display_id=self._display_id)

    def _shown(self) -> dict[str, Any]:
        """Return the picture as an output."""
        data = {"text/plain": ""}
        if self._picture:
            data["image/png"] = base64.b64encode(self._picture).decode()
        about = {"image/png": {"alt": f"StereoCell: {self.name}"}} if self._picture else {}
        return {"obj": data, "metadata": about}

    # --- the page's side

    def set_state(self, sync_data: dict[str, Any]) -> None:
        """Take what the page tells."""
        self._is_told = True
        try:
            super().set_state(sync_data)
        finally:
            self._is_told = False

    def _hear(self, _: Any, content: Any, buffers: Any) -> None:
        """Answer what a page asks for."""
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

    # --- what may be set

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
    def _begin_anew(self, _: Any) -> None:
        """A link is a whole view: what was set before it is over, unless the page tells of it."""
        if not self._is_told:
            self.channels, self.view = {}, {}
            self.set_trait("picked", None)
