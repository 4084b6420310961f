"""The widget and its answers to a page, tested without a browser."""

import io
import json
import sys

import pytest
from IPython.core.displaypub import CapturingDisplayPublisher
from IPython.core.interactiveshell import InteractiveShell
from PIL import Image

import stereocell
from stereocell.bundle import blob_page
from stereocell.model.errors import StereoCellError, UsageError
from stereocell.notebook import page
from stereocell.notebook.bundle_files import NotebookBundle
from stereocell.notebook.widget import Viewer

pytestmark = pytest.mark.usefixtures("built_page")


@pytest.fixture
def viewer(bundle, monkeypatch):
    made = Viewer(NotebookBundle(bundle), draw=lambda looks: png())
    made.sent = []
    monkeypatch.setattr(
        made, "send", lambda content, buffers=(): made.sent.append((content, list(buffers)))
    )
    return made


def png(colour="red"):
    file = io.BytesIO()
    Image.new("RGB", (4, 3), colour).save(file, "PNG")
    return file.getvalue()


def hear(viewer, content, buffers=()):
    viewer._handle_custom_msg(content, list(buffers))
    return viewer.sent.pop() if viewer.sent else None


def test_a_page_is_sent_packed_and_by_name(viewer):
    content, buffers = hear(viewer, {"ask": "page", "id": "a/1"})
    assert content["id"] == "a/1"
    assert content["html"] == page.document()
    assert dict(zip(content["names"], buffers, strict=True)) == {
        "index-1.css": b"style",
        "viewer-1.js": b"packed",
    }


def test_a_file_is_sent_with_its_status(viewer, bundle):
    whole = (bundle / "manifest.json").read_bytes()
    asked = {"ask": "file", "id": "a/2", "path": "manifest.json", "range": "bytes=0-9"}
    assert hear(viewer, asked) == ({"id": "a/2", "status": 206}, [whole[:10]])
    asked = {"ask": "file", "id": "a/3", "path": "../stage/stage.usda", "range": None}
    assert hear(viewer, asked) == ({"id": "a/3", "status": 404}, [b""])


@pytest.mark.parametrize("content", [None, "page", {}, {"ask": "rm"}, {"ask": ["page"]}])
def test_a_message_that_is_not_a_request_gets_no_answer(viewer, content):
    assert hear(viewer, content) is None


def test_no_path_of_this_machine_is_in_the_state(viewer, bundle):
    state = {name: value for name, value in viewer.get_state().items() if name[:4] != "_esm"}
    text = json.dumps(state, default=str)
    assert str(bundle) not in text
    assert str(bundle.parent) not in text
    assert viewer.name == "two tiles"


def test_values_that_are_set_are_checked_and_values_from_the_page_are_observed(viewer):
    with pytest.raises(UsageError, match="there is no 'CD8', expected CD31"):
        viewer.channels = {"CD8": {"visible": False}}
    assert viewer.channels == {}
    viewer.set_channel("CD31", opacity=0.5)
    viewer.set_channel("CD31", visible=False)
    assert viewer.channels == {"CD31": {"opacity": 0.5, "visible": False}}
    seen = []
    viewer.observe(lambda change: seen.append(change["new"]), "view")
    view = {"eye_um": [1.0, 2.0, 3.0], "target_um": [0.0, 0.0, 0.0]}
    viewer.set_state({"view": view, "picked": {"point_um": [1, 2, 3], "tile": "r0_c0"}})
    assert seen == [view]
    assert viewer.picked == {"point_um": [1.0, 2.0, 3.0], "tile": "r0_c0"}


def test_a_link_that_is_set_replaces_the_view_and_one_from_the_page_does_not(viewer):
    viewer.set_channel("CD31", opacity=0.5)
    viewer.picked = {"point_um": (1, 2, 3)}
    viewer.set_state({"link": "#v=1&tile=r0_c1"})
    assert viewer.channels
    assert viewer.picked
    viewer.link = "https://me.example/#v=1&tile=r0_c0"
    assert (viewer.link, viewer.channels, viewer.picked) == ("#v=1&tile=r0_c0", {}, None)


@pytest.fixture
def published():
    shell = InteractiveShell.instance()
    before, shell.display_pub = shell.display_pub, CapturingDisplayPublisher()
    yield shell.display_pub.outputs
    shell.display_pub = before
    InteractiveShell.clear_instance()


def test_the_output_of_a_viewer_is_the_widget_and_a_picture_below_it(viewer, published):
    viewer._ipython_display_()
    widget, picture = (output["data"] for output in published)
    assert widget["application/vnd.jupyter.widget-view+json"]["model_id"] == viewer.model_id
    assert "two tiles" in widget["text/plain"]
    assert "image/png" not in widget
    assert picture["image/png"].startswith("iVBORw0KGgo")
    assert published[1]["metadata"] == {"image/png": {"alt": "StereoCell: two tiles"}}
    assert published[1]["transient"]["display_id"]


def test_a_picture_that_the_page_sends_replaces_the_first_one_and_the_widget_stays(
    viewer, published
):
    viewer._ipython_display_()
    first = viewer._picture
    hear(viewer, {"ask": "picture"}, [memoryview(png("blue"))])
    assert viewer._picture == png("blue") != first
    _, shown, again = published
    assert again["update"]
    assert again["transient"] == shown["transient"]
    assert again["data"]["image/png"] != shown["data"]["image/png"]
    assert again["metadata"] == shown["metadata"]


def test_bytes_that_are_not_a_picture_are_not_kept(viewer):
    for sent in ([], [memoryview(b"<svg>")], [memoryview(png() + bytes(5 * 2**20))]):
        hear(viewer, {"ask": "picture"}, sent)
        assert viewer._picture == b""


def test_the_page_s_first_picture_is_kept_where_python_can_draw_none(bundle, published):
    viewer = Viewer(NotebookBundle(bundle))
    viewer._ipython_display_()
    assert "image/png" not in published[1]["data"]
    viewer._handle_custom_msg({"ask": "picture"}, [memoryview(png())])
    assert "image/png" in published[2]["data"]


def test_a_bundle_by_itself_is_shown_as_the_view_asks_for(bundle):
    view = {"eye_um": (0, 0, 9), "target_um": (0, 0, 0)}
    viewer = stereocell.show(bundle, height=300, view=view)
    assert viewer.height == 300
    assert viewer.view["eye_um"] == [0.0, 0.0, 9.0]


@pytest.mark.parametrize(
    ("source", "more", "message"),
    [
        (5, {}, "source is 5, expected an array or a path"),
        ("missing.tif", {}, "missing.tif"),
        ("missing.tif", {"quality": "best"}, "quality is 'best', expected one of auto, full"),
        ("missing.tif", {"zoom": 2}, "show has no argument 'zoom'"),
    ],
)
def test_a_wrong_argument_is_refused_in_one_line(source, more, message, tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    before = set(tmp_path.iterdir())
    with pytest.raises(StereoCellError, match=message) as refused:
        stereocell.show(source, **more)
    assert "\n" not in str(refused.value)
    assert set(tmp_path.iterdir()) == before  # nothing half-made stays


def test_a_missing_anywidget_or_page_gives_a_line_with_the_remedy(bundle, monkeypatch):
    monkeypatch.setattr(blob_page, "viewer_dist", lambda: None)
    with pytest.raises(UsageError, match="the viewer is not built: run `make setup`"):
        stereocell.show(bundle)
    monkeypatch.setitem(sys.modules, "anywidget", None)
    with pytest.raises(UsageError, match=r"pip install 'stereocell\[notebook\]'"):
        stereocell.show(bundle)
