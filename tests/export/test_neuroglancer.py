"""A folder for Neuroglancer: another library reads its image, and its meshes follow the format.

Neuroglancer itself draws both."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from itertools import pairwise
from pathlib import Path
from threading import Thread
from typing import Any

import DracoPy
import numpy as np
import pytest
import tensorstore
from numpy.typing import NDArray
from PIL import Image

from stereocell.export.options import ExportOptions
from stereocell.export.write import export_stage
from stereocell.model.errors import OutputError, UsageError
from stereocell.storage.overwriting import forcing
from support import spheres

VIEWER = Path(__file__).parents[2] / "viewer_gltf"
WHOLE = (9, 20, 40)  # voxels (z, y, x) of both tiles


@pytest.fixture(scope="module")
def folder(sphere_stage: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("precomputed") / "s.precomputed"
    line = export_stage(sphere_stage, path, options=ExportOptions())
    assert line.endswith("1 scales; mesh: CD31, up to 3 levels of detail")
    return path


def read_meshes(folder: Path, segment: int) -> list[tuple[NDArray[np.float64], NDArray[Any]]]:
    """Return each level's vertices in nm and its triangles, by the format's specification."""
    info = json.loads((folder / "info").read_text("utf-8"))
    assert info["@type"] == "neuroglancer_multilod_draco"
    most = (1 << info["vertex_quantization_bits"]) - 1
    data = (folder / f"{segment}.index").read_bytes()
    shape, origin = np.frombuffer(data, "<f4", 6).reshape(2, 3)
    (count,) = np.frombuffer(data, "<u4", 1, 24)
    at = 28 + 4 * count
    scales = np.frombuffer(data, "<f4", count, 28)
    assert all(a < b for a, b in pairwise(scales))
    offsets = np.frombuffer(data, "<f4", 3 * count, at).reshape(-1, 3)
    fragments = np.frombuffer(data, "<u4", count, at + 12 * count)
    at += 16 * count
    stored, start, found = (folder / str(segment)).read_bytes(), 0, []
    for level in range(count):
        assert fragments[level] == 1
        place, size = np.frombuffer(data, "<u4", 3, at), np.frombuffer(data, "<u4", 1, at + 12)[0]
        at += 16
        mesh = DracoPy.decode(stored[start : start + size])
        start += size
        cell = shape * 2.0**level
        vertices = origin + offsets[level] + cell * (place + mesh.points.astype(float) / most)
        found.append((vertices, mesh.faces))
    assert (at, start) == (len(data), len(stored))
    return found


def test_another_library_reads_the_image_at_each_scale(folder: Path) -> None:
    where = {"driver": "file", "path": str(folder / "image")}
    store = tensorstore.open({"driver": "neuroglancer_precomputed", "kvstore": where}).result()
    voxels = store.read().result()
    assert voxels.shape == (*WHOLE[::-1], 2)
    assert store.schema.dimension_units[:3] == (
        tensorstore.Unit("500 nm"), tensorstore.Unit("500 nm"), tensorstore.Unit("1000 nm"),
    )  # fmt: skip
    ball = spheres.ball((0, 0, 0), WHOLE)
    np.testing.assert_array_equal(voxels[..., 0], ball.transpose(2, 1, 0))


def test_scales_are_means_until_one_chunk_holds_all(tmp_path: Path) -> None:
    from stereocell.export.neuroglancer import _halved

    values = np.arange(2 * 3 * 5 * 7, dtype=np.uint16).reshape(2, 3, 5, 7)
    made, spacing = _halved(values, (100.0, 100.0, 250.0), tmp_path / "1")
    assert spacing == (200.0, 200.0, 250.0)
    assert made.shape == (2, 3, 3, 4)
    np.testing.assert_allclose(made[1, 2, 0, 0], values[1, 2, :2, :2].mean(), atol=0.5)
    np.testing.assert_array_equal(made[1, 2, 2, 3], values[1, 2, 4, 6])
    again, spacing = _halved(made, spacing, tmp_path / "2")
    assert (again.shape, spacing) == ((2, 2, 2, 2), (400.0, 400.0, 500.0))


def test_meshes_of_all_levels_lie_on_the_image(folder: Path) -> None:
    levels = read_meshes(folder / "mesh", 1)
    counts = [len(faces) for _, faces in levels]
    assert counts == sorted(counts, reverse=True)
    assert len(counts) == len(spheres.LEVELS)
    # The centre of voxel (0, 0, 0) is half a voxel from the corner; y grows downwards.
    x, y, z = spheres.CENTER
    center = np.array([x + 0.25, -y + 0.25, z + 0.5]) * 1e3
    for vertices, faces in levels:
        away = np.linalg.norm(vertices - center, axis=1)
        np.testing.assert_allclose(away, spheres.RADIUS * 1e3, atol=1)
        a, b, c = (vertices - center)[faces].transpose(1, 0, 2)
        assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() > 0  # faces point outwards
    names = json.loads((folder / "mesh" / "segment_properties" / "info").read_text("utf-8"))[
        "inline"
    ]
    assert names["ids"] == ["1"]
    assert names["properties"] == [{"id": "label", "type": "label", "values": ["CD31"]}]


def test_same_stage_gives_the_same_folder_and_replaces_an_older_one(
    sphere_stage: Path, folder: Path, tmp_path: Path
) -> None:
    path = tmp_path / "s.precomputed"
    path.mkdir()
    (path / "mine.txt").touch()
    with (
        forcing(False),
        pytest.raises(OutputError, match=r"something else \(mine\.txt\)"),
    ):
        export_stage(sphere_stage, path, options=ExportOptions())
    (path / "image").mkdir()
    (path / "image" / "info").touch()
    export_stage(sphere_stage, path, options=ExportOptions())
    files = [file.relative_to(folder) for file in sorted(folder.rglob("*")) if file.is_file()]
    again = [file.relative_to(path) for file in sorted(path.rglob("*")) if file.is_file()]
    assert files == again
    assert all((path / one).read_bytes() == (folder / one).read_bytes() for one in files)
    assert list(tmp_path.iterdir()) == [path]


def test_missing_draco_is_reported_with_how_to_install_it(
    sphere_stage: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "DracoPy", None)
    for name, options in (
        ("s.precomputed", ExportOptions()), ("s.glb", ExportOptions(compress="draco")),
    ):  # fmt: skip
        with pytest.raises(UsageError, match=r"pip install 'stereocell\[draco\]'"):
            export_stage(sphere_stage, tmp_path / name, options=options)
    assert not list(tmp_path.iterdir())


class _Ranges(SimpleHTTPRequestHandler):
    """Serves files and byte ranges to another page; Neuroglancer loads meshes by ranges."""

    def do_GET(self) -> None:
        file = Path(self.translate_path(self.path))
        if not file.is_file():
            self.send_error(404)
            return
        data, wanted = file.read_bytes(), self.headers.get("Range", "")
        first, _, last = wanted.removeprefix("bytes=").partition("-")
        start, stop = int(first or 0), int(last or len(data) - 1) + 1
        self.send_response(206 if wanted else 200)
        if wanted:
            self.send_header("Content-Range", f"bytes {start}-{stop - 1}/{len(data)}")
        self._end(data[start:stop])

    def do_OPTIONS(self) -> None:
        self.send_response(204)
        self.send_header("Access-Control-Allow-Headers", "*")
        self._end(b"")

    def log_message(self, *_: Any) -> None:
        """Nothing goes to stderr."""

    def _end(self, data: bytes) -> None:
        self.send_header("Access-Control-Allow-Origin", "*")
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data)


@contextmanager
def served(folder: Path) -> Iterator[str]:
    handler = type("Bound", (_Ranges,), {"directory": str(folder)})
    handler.__init__ = lambda self, *args: _Ranges.__init__(self, *args, directory=str(folder))
    http = ThreadingHTTPServer(("127.0.0.1", 0), handler)
    Thread(target=http.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{http.server_port}"
    http.shutdown()
    http.server_close()


SHOOT = """
import { chromium } from 'playwright-core'
const [path, url, picture] = process.argv.slice(1)
const args = ['--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
              '--no-sandbox', '--ignore-gpu-blocklist']
const browser = await chromium.launch({ executablePath: path, args })
const page = await browser.newPage({ viewport: { width: 800, height: 600 } })
await page.goto(url)
await new Promise((done) => setTimeout(done, 12000))
await page.screenshot({ path: picture })
await browser.close()
"""


@pytest.mark.exhaustive
@pytest.mark.filterwarnings("default")
def test_neuroglancer_draws_image_and_mesh(folder: Path, tmp_path: Path) -> None:
    neuroglancer = pytest.importorskip("neuroglancer")
    node, chromium = shutil.which("node"), os.environ.get("CHROMIUM") or shutil.which("chromium")
    if not (node and chromium and (VIEWER / "node_modules" / "playwright-core").is_dir()):
        pytest.skip("node, chromium and the viewer's packages are missing: run make setup browser")
    with served(folder) as url:
        viewer = neuroglancer.Viewer()
        with viewer.txn() as state:
            state.layers["image"] = neuroglancer.ImageLayer(source=f"precomputed://{url}/image")
            state.layers["mesh"] = neuroglancer.SegmentationLayer(
                source=f"precomputed://{url}/mesh", segments=[1], segment_colors={1: "#ff8000"}
            )
            state.cross_section_scale = 5e-8  # metres per pixel
            state.layout = neuroglancer.row_layout(
                [
                    neuroglancer.LayerGroupViewer(layers=["image"], layout="xy"),
                    neuroglancer.LayerGroupViewer(layers=["mesh"], layout="3d"),
                ]
            )
        command = [node, "--input-type=module", "-e", SHOOT, chromium, viewer.get_viewer_url()]
        picture = tmp_path / "shot.png"
        subprocess.run([*command, str(picture)], cwd=VIEWER, check=True, timeout=120)
    pixels = np.asarray(Image.open(picture).convert("RGB")).astype(int)[80:500]
    left, right = pixels[:, :400], pixels[:, 400:]
    grey = (np.ptp(left, axis=-1) == 0) & (left[..., 0] > 200)
    orange = (right[..., 0] > 100) & (right[..., 2] < 0.4 * right[..., 0])
    assert grey.sum() > 4000, picture
    assert orange.sum() > 4000, picture
