"""The Unity package's ray march agrees with a float64 reference and with theory.

march.hlsl uses only syntax that HLSL and C++ share. g++ compiles the file itself, with the few
vector types of hlsl.hpp. Unity's world is the specimen's world mirrored in x, and so are the boxes
in these tests.
"""

import shutil
import struct
import subprocess
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from support.exhaustive import sweep
from support.reference_raymarch import FILL, LIGHT, Block, Camera, Values, psnr, render

HERE = Path(__file__).parent
SHADERS = HERE.parents[1] / "usd_assets" / "unity" / "Runtime" / "Shaders"
MIRROR = np.array([-1.0, 1.0, 1.0])
FAR = 1e30

pytestmark = pytest.mark.skipif(shutil.which("g++") is None, reason="needs g++")


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compile the shader's march into a program, with float literals as in HLSL."""
    path = tmp_path_factory.mktemp("march") / "march"
    subprocess.run(
        [
            *("g++", "-std=c++17", "-O2", "-fsingle-precision-constant"),
            *("-Wall", "-Wextra", "-Werror"),
            *(f"-I{SHADERS}", str(HERE / "march.cpp"), "-o", str(path)),
        ],
        check=True,
    )
    return path


@dataclass(frozen=True)
class Marched:
    light: Values  # (rays, 4), linear, premultiplied
    samples: NDArray[np.int64]  # (rays,), samples of the volume for each ray


@dataclass(frozen=True)
class How:
    steps: int = 100
    spare: int = 0
    shading: float = 0.0
    shift: float = 0.5
    scene_um: float = FAR
    shown: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0)


def march(
    program: Path,
    block: Block,
    eye: Values,
    direction: Values,
    how: How = How(),
    whole: tuple[Values, Values] | None = None,
    lamps: tuple[Values, Values] | None = None,
) -> Marched:
    """March rays, given in the specimen's world; `whole` is the box around all tiles."""
    size = np.array(block.channels[0].shape[::-1])
    texels = np.zeros((*size[::-1], 4), np.uint8)
    tables = np.zeros((4, 256, 4))
    colors = np.zeros((4, 4))
    count = len(block.channels)
    for c, voxels in enumerate(block.channels):
        texels[..., c] = voxels
    tables[:count], colors[:count, :3] = block.tables, block.colors
    low, high = np.array(block.low_um), np.array(block.high_um)
    # The low corner of the mirrored box has the largest x of the specimen, so it lies at the last
    # texel of x. Rows of the image run against y in both worlds.
    corner = MIRROR * [high[0], low[1], low[2]]
    first, last = (block.apron + 0.5) / size, (size - block.apron - 0.5) / size
    tex_low = [last[0], last[1], first[2]]
    tex_high = [first[0], first[1], last[2]]
    voxel = block.spacing_um().min()
    a, b = whole or (low, high)
    all_low, all_high = MIRROR * [b[0], a[1], a[2]] - corner, MIRROR * [a[0], b[1], b[2]] - corner
    key, fill = lamps or (np.array([0.0, 0, 1]),) * 2
    rays = np.zeros((len(eye), 8), np.float32)
    rays[:, :3] = MIRROR * eye - corner
    rays[:, 3] = how.scene_um
    rays[:, 4:7] = MIRROR * direction

    def vectors(*rows: object) -> bytes:
        out = np.zeros((len(rows), 4), np.float32)
        for i, row in enumerate(rows):
            values = np.asarray(row, np.float32)
            out[i, : len(values)] = values
        return out.tobytes()

    data = (
        struct.pack("<3i", *size)
        + texels.tobytes()
        + np.rint(255 * tables).astype(np.uint8).tobytes()
        + vectors(high - low, tex_low, tex_high, all_low, all_high, how.shown, *colors)
        + vectors([voxel, voxel, how.steps, how.spare], [how.shading, how.shift])
        + vectors(MIRROR * key, MIRROR * fill, [0, 1, 0])
        + struct.pack("<i", len(rays))
        + rays.tobytes()
    )
    done = subprocess.run([program], input=data, capture_output=True, check=True)
    found = np.frombuffer(done.stdout, np.float32).reshape(-1, 5).astype(np.float64)
    assert len(found) == len(rays)
    return Marched(found[:, :4], found[:, 4].astype(np.int64))


def picture(program: Path, block: Block, camera: Camera, how: How) -> Values:
    eye, direction = camera.rays()
    axes = np.stack(camera.axes())
    lamps = tuple(np.divide(lamp, np.linalg.norm(lamp)) @ axes for lamp in (LIGHT, FILL))
    light = march(program, block, np.array(eye), direction, how, lamps=(lamps[0], lamps[1])).light
    return light.reshape(camera.size_px[1], camera.size_px[0], 4)


def waves(shape: tuple[int, int, int], seed: int, fades: bool) -> NDArray[np.uint8]:
    """Return broad waves, 0..255; with `fades` they fade to 0 towards the faces."""
    phase = np.random.default_rng(seed).uniform(0, 6, 3)
    axes = np.meshgrid(*(np.linspace(0, 1, n) for n in shape), indexing="ij")
    wave: Values = 0.5 + 0.5 * np.cos(
        sum((7 + 2 * i) * x + p for i, (x, p) in enumerate(zip(axes, phase, strict=True)))
    )
    if fades:
        r = np.sqrt(sum((2 * x - 1) ** 2 for x in axes))
        wave = wave * np.clip((0.8 - r) / 0.2, 0, 1)
    voxels: NDArray[np.uint8] = np.rint(255 * wave).astype(np.uint8)
    return voxels


def block_of(*channels: NDArray[np.uint8], opacity: float = 0.2) -> Block:
    """Return a block of channels: an apron of 1, voxels of 1 x 1 x 2 um, and rising opacities."""
    x, y, z = (np.array(channels[0].shape[::-1]) - 3) * np.array([1.0, 1.0, 2.0])
    tables = np.ones((len(channels), 256, 4))
    tables[..., 3] = np.rint(255 * opacity * np.linspace(0, 1, 256)) / 255
    tables[..., 1] = np.rint(np.linspace(255, 128, 256)) / 255
    colors = np.array([[1.0, 0.4, 0.1], [0.1, 0.8, 0.3], [0.2, 0.3, 1.0]])[: len(channels)]
    low = (3.0, -y - 2.0, 5.0)
    return Block(channels, low, (3.0 + x, -2.0, 5.0 + z), tables, colors)


def aslant(block: Block, size_px: int = 40) -> Camera:
    middle = (np.array(block.low_um) + block.high_um) / 2
    eye = middle + np.array([0.9, 0.7, 2.2]) * np.linalg.norm(np.subtract(block.high_um, middle))
    return Camera(tuple(eye), tuple(middle), (size_px, size_px), fov_deg=35.0)


@pytest.mark.slow
def test_a_uniform_cube_has_the_opacity_of_its_length(program: Path) -> None:
    block = block_of(np.full((11, 40, 40), 255, np.uint8), opacity=0.1)
    per_voxel = np.rint(25.5) / 255
    middle = (np.array(block.low_um) + block.high_um) / 2
    slanted = np.array([0.6, 0.0, 0.8])
    for direction, length in (([0, 0, -1.0], 16.0), (-slanted, 20.0)):
        eye = middle - 100 * np.array(direction)
        found = march(program, block, eye[None], np.array([direction]))
        a = 1 - (1 - per_voxel) ** length
        tint = block.colors[0] * [1, 128 / 255, 1]
        assert found.light[0] == pytest.approx([*(tint * a), a], abs=2e-5)


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 2, 3])
def test_an_unshaded_picture_agrees_with_the_reference(program: Path, count: int) -> None:
    block = block_of(*(waves((18, 44, 40), seed, fades=False) for seed in range(count)))
    camera = aslant(block)
    found = picture(program, block, camera, How())
    expected = render(block, camera, shading=False)
    assert expected[..., 3].max() > 0.9
    assert np.abs(found - expected).max() < 0.02
    assert psnr(np.rint(255 * found[..., :3]), np.rint(255 * expected[..., :3])) > 45


@pytest.mark.slow
@pytest.mark.parametrize("fades", sweep([True, False], kept=[False]))  # False: cut by the box
@pytest.mark.parametrize("count", sweep([1, 2], kept=[2]))
def test_a_shaded_picture_agrees_with_the_reference(program: Path, count: int, fades: bool) -> None:
    block = block_of(*(waves((24, 44, 40), seed, fades) for seed in range(count)))
    camera = aslant(block)
    found = picture(program, block, camera, How(shading=1.0))
    expected = render(block, camera)
    dark = render(block, camera, shading=False)
    assert np.abs(expected - dark).max() > 0.1  # shading changes the image visibly
    assert np.abs(found - expected).max() < 0.04
    assert psnr(np.rint(255 * found[..., :3]), np.rint(255 * expected[..., :3])) > 42


@pytest.mark.slow
def test_a_flipped_volume_differs_from_the_reference(program: Path) -> None:
    """The comparison of images detects a flip of x, y or z."""
    voxels = waves((18, 44, 40), 1, fades=False)
    camera = aslant(block_of(voxels))
    expected = render(block_of(voxels), camera, shading=False)
    for axis in range(3):
        found = picture(program, block_of(np.flip(voxels, axis).copy()), camera, How())
        assert np.abs(found - expected).max() > 0.2


def test_a_hidden_channel_absorbs_nothing(program: Path) -> None:
    both = block_of(waves((18, 44, 40), 0, False), waves((18, 44, 40), 1, False))
    alone = replace(
        both, channels=both.channels[1:], tables=both.tables[1:], colors=both.colors[1:]
    )
    camera = aslant(both)
    found = picture(program, both, camera, How(shown=(0, 1, 1, 1)))
    assert np.allclose(found, picture(program, alone, camera, How()), atol=1e-6)


@pytest.mark.slow
def test_no_ray_takes_more_than_its_steps_and_each_reaches_its_end(program: Path) -> None:
    block = block_of(np.full((80, 300, 300), 255, np.uint8), opacity=0.005)
    camera = aslant(block, 12)
    eye, direction = camera.rays()
    for steps in (100, 10):
        found = march(program, block, np.array(eye), direction, How(steps=steps))
        assert found.samples.max() == steps
        middle = render(block, camera, step_voxels=1, shading=False).reshape(-1, 4)
        seen = middle[:, 3] > 0.1
        assert np.allclose(found.light[seen, 3], middle[seen, 3], atol=1e-3)


def test_tiles_share_the_steps_of_a_ray(program: Path) -> None:
    shape = (20, 60, 203)
    whole = block_of(waves(shape, 3, fades=False), opacity=0.012)
    voxels, (x0, y0, z0), (_, y1, z1) = whole.channels[0], whole.low_um, whole.high_um
    cut = x0 + 100.0
    left = replace(whole, channels=(voxels[:, :, :103],), high_um=(cut, y1, z1))
    right = replace(whole, channels=(voxels[:, :, 100:],), low_um=(cut, y0, z0))
    box = (np.array(whole.low_um), np.array(whole.high_um))
    eye = np.array([[x0 - 50.0, (y0 + y1) / 2, (z0 + z1) / 2]]) + np.zeros((1, 3))
    direction = np.array([[1.0, 0.02, 0.01]])
    direction /= np.linalg.norm(direction)
    how = How(spare=1)
    near, far = (march(program, tile, eye, direction, how, box) for tile in (left, right))
    assert near.samples[0] + far.samples[0] <= 100
    assert abs(near.samples[0] - far.samples[0]) <= 1
    together = near.light + (1 - near.light[:, 3:]) * far.light
    assert together == pytest.approx(march(program, whole, eye, direction).light, abs=4e-3)


def test_many_tiles_take_no_more_steps_than_the_ray_has(program: Path) -> None:
    """There are one large tile and nine thin ones, and each takes at least one step."""
    edges = [0.0, 100.0, *(100.0 + i for i in range(1, 10))]
    box = (np.array([0.0, -9, 0]), np.array([109.0, 0, 9]))
    eye, direction = np.array([[-50.0, -4.5, 4.5]]), np.array([[1.0, 0, 0]])
    samples = 0
    for low, high in pairwise(edges):
        voxels = np.full((12, 12, int(high - low) + 3), 20, np.uint8)
        block = block_of(voxels, opacity=0.01)
        block = replace(block, low_um=(low, -9.0, 0.0), high_um=(high, 0.0, 9.0))
        samples += int(march(program, block, eye, direction, How(20, spare=9), box).samples[0])
    assert 15 <= samples <= 20


def test_rays_begin_at_an_eye_inside_the_box_and_end_at_the_scene(program: Path) -> None:
    block = block_of(np.full((11, 40, 40), 255, np.uint8), opacity=0.1)
    per_voxel = np.rint(25.5) / 255
    middle = (np.array(block.low_um) + block.high_um) / 2
    away = np.array([[0.0, 0.0, -1.0]])
    inside = march(program, block, middle[None], away).light[0, 3]
    assert inside == pytest.approx(1 - (1 - per_voxel) ** 8, abs=2e-5)
    eye = (middle + np.array([0, 0, 100.0]))[None]
    hidden = march(program, block, eye, away, How(scene_um=100 - 8 + 3)).light[0, 3]
    assert hidden == pytest.approx(1 - (1 - per_voxel) ** 3, abs=2e-5)
    assert march(program, block, eye, away, How(scene_um=50)).light.max() == 0
    assert march(program, block, eye, -away).light.max() == 0


def test_a_ray_that_ends_early_is_opaque(program: Path) -> None:
    block = block_of(np.full((11, 40, 40), 255, np.uint8), opacity=0.9)
    middle = (np.array(block.low_um) + block.high_um) / 2
    found = march(
        program, block, (middle + np.array([0, 0, 100.0]))[None], np.array([[0, 0, -1.0]])
    )
    assert found.light[0, 3] == 1
    assert found.samples[0] < 5
