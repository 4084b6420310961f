"""Slicing an atlas by the recipes in docs/unity-volumes.md returns the volume of the tile.

The atlas is read by three.js, whose EXR reader shares no code with the library that wrote it.
"""

import json
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from pxr import Usd

from support.phantoms import f_phantom
from support.stages import F_ID, SPACING_UM, TILES, leaf, make_tiles, write_whole

ROOT = Path(__file__).parents[2]
VIEWER = ROOT / "viewer_gltf"
READER = """
import { readFile, writeFile } from "node:fs/promises";
import { EXRLoader } from "three/examples/jsm/loaders/EXRLoader.js";
const [path, out] = process.argv.slice(-2);
const bytes = await readFile(path);
console.warn = () => {}; // it skips atlasSize, whose type it does not know
const { header, width, height, data, flipY } = new EXRLoader().parse(bytes.buffer);
await writeFile(out, data);
const { columns, rows, channels } = header;
const names = channels.map(({ name }) => name);
console.log(JSON.stringify({ columns, rows, names, width, height, flipY, parts: data.length }));
"""
needs_viewer = pytest.mark.skipif(
    shutil.which("node") is None or not (VIEWER / "node_modules" / "three").is_dir(),
    reason="needs Node.js and the viewer's packages: run `make setup`",
)


@dataclass(frozen=True)
class Atlas:
    """The image, float16 (rows of pixels from above, columns), and the numbers for the recipe."""

    image: NDArray[np.float16]
    columns: int
    rows: int
    size: tuple[int, int, int]  # voxels (x, y, z)
    low: NDArray[np.float64]
    high: NDArray[np.float64]

    @property
    def spacing(self) -> NDArray[np.float64]:
        """um (x, y, z)."""
        return (self.high - self.low) / (np.array(self.size) - 3)


@pytest.fixture(scope="module")
def stage_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_whole(tmp_path_factory.mktemp("stage"))


@pytest.fixture(params=TILES)
def tile(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def atlas(stage_path: Path, tile: str, tmp_path: Path) -> Atlas:
    stage = Usd.Stage.Open(str(stage_path))
    tile_prim = stage.GetPrimAtPath(f"/Specimen/Tiles/{tile}")
    tile_prim.GetVariantSet("representation").SetVariantSelection("volume")
    prim = stage.GetPrimAtPath(leaf(tile, F_ID, "_volume"))
    path = prim.GetAttribute("stereocell:atlas").Get().resolvedPath
    command = ["node", "--input-type=module", "-e", READER, path, str(tmp_path / "pixels")]
    done = subprocess.run(command, cwd=VIEWER, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["names"] == ["Y"]
    assert found["flipY"] is False  # its first row is the lowest
    pixels = np.fromfile(tmp_path / "pixels", np.float16)
    image = pixels.reshape(found["height"], found["width"], -1)[::-1, :, 0]
    width, height, depth = prim.GetAttribute("stereocell:atlasSize").Get()
    low, high = (np.array(prim.GetAttribute(f"stereocell:bounds{e}").Get()) for e in ("Min", "Max"))
    return Atlas(image, found["columns"], found["rows"], (width, height, depth), low, high)


def sliced_in_unreal(atlas: Atlas) -> NDArray[np.float16]:
    """Return the texture that Volume Texture makes: (w, v, u), v from above."""
    nx, ny, _ = atlas.size
    across, down = atlas.image.shape[1] // nx, atlas.image.shape[0] // ny
    cells = [
        atlas.image[ny * (k // across) : ny * (k // across + 1), nx * (k % across) :][:, :nx]
        for k in range(across * down)
    ]
    return np.stack(cells)


def sliced_in_unity(atlas: Atlas) -> NDArray[np.float16]:
    """Return the texture that Texture Shape 3D makes: (w, v, u), v from below."""
    height, width = (
        n // parts for n, parts in zip(atlas.image.shape, (atlas.rows, atlas.columns), strict=True)
    )
    sheet = atlas.image.reshape(atlas.rows, height, atlas.columns, width).transpose(0, 2, 1, 3)
    return sheet.reshape(-1, height, width)[:, ::-1]


@pytest.mark.slow
@needs_viewer
def test_slicing_by_either_recipe_returns_the_volume(atlas: Atlas, tile: str) -> None:
    (content,) = (each for each in make_tiles() if each.id == tile)
    (channel,) = (each for each in content.channels if each.channel_id == F_ID)
    expected = (channel.volume / 255).astype(np.float16)
    nx, ny, nz = atlas.size
    assert expected.shape == (nz, ny, nx)
    unreal, unity = sliced_in_unreal(atlas), sliced_in_unity(atlas)
    deep = atlas.columns * atlas.rows
    assert unreal.shape == unity.shape == (deep, ny, nx)
    assert deep > nz  # the black cells are tested too
    assert np.array_equal(unreal[:nz], expected)
    assert np.array_equal(unity[:nz, ::-1], expected)
    assert not unreal[nz:].any()
    assert not unity[nz:].any()
    assert np.array_equal(np.rint(unreal[:nz].astype(np.float64) * 255), channel.volume)


@pytest.mark.slow
@needs_viewer
def test_voxels_lie_where_the_recipe_states(atlas: Atlas) -> None:
    depth_um, height_um, width_um = SPACING_UM
    assert np.allclose(atlas.spacing, [width_um, height_um, depth_um], rtol=1e-6)
    texture = sliced_in_unity(atlas)
    nx, ny, nz = atlas.size
    letter = f_phantom() > 500
    k, j, i = np.indices((nz, ny, nx)).reshape(3, -1)
    x = atlas.low[0] + (i - 1) * atlas.spacing[0]
    y = atlas.high[1] - (j - 1) * atlas.spacing[1]
    z = atlas.low[2] + (k - 1) * atlas.spacing[2]
    # The letter at that position in the world; its outermost voxels repeat beyond it.
    at = [np.rint(a / h).astype(int) for a, h in zip((z, -y, x), SPACING_UM, strict=True)]
    at = [np.clip(a, 0, n - 1) for a, n in zip(at, letter.shape, strict=True)]
    u, v, w = (i + 0.5) / nx, 1 - (j + 0.5) / ny, (k + 0.5) / len(texture)
    texels = [
        np.floor(coordinate * n).astype(int)
        for coordinate, n in zip((w, v, u), texture.shape, strict=True)
    ]
    assert np.array_equal(texture[tuple(texels)] > 0.5, letter[tuple(at)])


def test_the_recipe_states_the_formulas_that_this_test_uses() -> None:
    recipe = (ROOT / "docs" / "unity-volumes.md").read_text("utf-8")
    formulas = [
        "x = low.x + (i - 1) sx      y = high.y - (j - 1) sy      z = low.z + (k - 1) sz",
        "u = (i + 0.5) / nx      v = 1 - (j + 0.5) / ny      w = (k + 0.5) / D",
        "u = (i + 0.5) / nx      v = (j + 0.5) / ny      w = (k + 0.5) / D",
        "s = (high - low) / (n - 3)",
    ]
    for formula in formulas:
        assert formula in recipe
    named = set(re.findall(r"stereocell:\w+", recipe))
    assert named == {f"stereocell:{n}" for n in ("atlasSize", "boundsMin", "boundsMax")} | {
        "stereocell:opacityPoints"
    }
