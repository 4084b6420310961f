"""The float64 ray march agrees with theory on simple volumes."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from support.reference_raymarch import Block, Camera, Values, encode, path_voxels, psnr, render

SPACING = np.array([1.0, 1.0, 2.0])  # x, y, z


def block_of(*channels: NDArray[np.uint8], opacity: float = 0.1) -> Block:
    """Return channels with an apron of 1 and a table whose opacity is linear up to `opacity`."""
    count = np.array(channels[0].shape[::-1]) - 3
    tables = np.ones((len(channels), 256, 4))
    tables[..., 3] = np.linspace(0, opacity, 256)
    x, y, z = (float(n) for n in count * SPACING)
    return Block(channels, (0.0, -y, 0.0), (x, 0.0, z), tables, np.eye(4, 3)[: len(channels)])


def facing(block: Block, size_px: int = 1, fov_deg: float | None = 1.0) -> Camera:
    """Return a camera in front of the box, which looks along -z at its middle."""
    middle = (np.array(block.low_um) + block.high_um) / 2
    x, y, z = (float(v) for v in middle)
    half = None if fov_deg is not None else block.high_um[0] / 2
    eye = (x, y, z + 4 * block.high_um[2])
    return Camera(eye, (x, y, z), (size_px, size_px), fov_deg, half)


def smooth(seed: int) -> NDArray[np.uint8]:
    """Return a volume of broad waves, 0..255."""
    k = np.random.default_rng(seed).uniform(0.1, 0.3, 3)
    z, y, x = np.meshgrid(*(np.arange(n) for n in (14, 15, 16)), indexing="ij")
    wave: Values = np.cos(k[0] * z) * np.cos(k[1] * y) * np.cos(k[2] * x)
    voxels: NDArray[np.uint8] = np.rint(127.5 + 127.5 * wave).astype(np.uint8)
    return voxels


def test_a_uniform_cube_has_the_opacity_of_its_length() -> None:
    block = block_of(np.full((11, 9, 9), 255, np.uint8))
    r, g, b, a = render(block, facing(block), shading=False)[0, 0]
    assert a == pytest.approx(1 - 0.9**16, abs=1e-12)  # 8 intervals of 2 um; a voxel is 1 um
    assert (r, g, b) == (pytest.approx(a), 0, 0)
    assert path_voxels(block, facing(block))[0, 0] == pytest.approx(16)


def test_a_slanted_ray_has_the_opacity_of_its_length() -> None:
    block = block_of(np.full((11, 40, 40), 255, np.uint8))
    camera = Camera((18.5 + 30, -18.5, 8 + 40), (18.5, -18.5, 8), (1, 1), fov_deg=1.0)
    a = render(block, camera, shading=False)[0, 0, 3]
    assert a == pytest.approx(1 - 0.9 ** (16 * 50 / 40), abs=1e-12)


def test_a_ramp_has_its_integral() -> None:
    n, most = 104, 0.3
    ramp = np.clip((np.arange(n) - 1) * 2, 0, 255)
    block = block_of(np.tile(ramp.astype(np.uint8)[:, None, None], (1, 5, 5)), opacity=most)
    # The opacity of a voxel rises linearly to b, so the logarithm of the transmittance is the
    # integral of ln(1 - b u) over the length.
    b = most * ramp[-2] / 255
    length = 2.0 * (n - 3)
    integral = length * (-(1 - b) * (np.log(1 - b) - 1) - 1) / b
    a = render(block, facing(block), shading=False)[0, 0, 3]
    assert a == pytest.approx(1 - np.exp(integral), abs=1e-6)


def test_nothing_is_drawn_in_an_empty_volume_or_beside_the_box() -> None:
    empty = block_of(np.zeros((6, 6, 6), np.uint8))
    assert not render(empty, facing(empty, 4, None)).any()
    full = block_of(np.full((6, 6, 6), 255, np.uint8))
    picture = render(full, facing(full, 4, fov_deg=19.0))
    assert not picture[0].any()
    assert picture[1:3, 1:3, 3].all()


@pytest.mark.slow
@pytest.mark.parametrize("shading", [False, True])
def test_picture_converges_when_steps_are_halved(shading: bool) -> None:
    block = block_of(smooth(0), smooth(1), opacity=0.5)
    camera = facing(block, 12, fov_deg=25.0)
    pictures = [render(block, camera, step, shading) for step in (1, 1 / 2, 1 / 4, 1 / 8, 1 / 16)]
    errors = [np.abs(p - pictures[-1]).max() for p in pictures[:-1]]
    assert all(fine < 0.6 * coarse for coarse, fine in pairwise(errors))
    assert errors[-1] < 0.5 / 255


def test_overlapping_channels_absorb_together_and_share_the_colour() -> None:
    full = np.full((5, 9, 9), 255, np.uint8)
    block = block_of(full, full)
    block.tables[1, :, 3] *= 2  # opacities 0.1 and 0.2 a voxel, over 4 voxels
    r, g, _, a = render(block, facing(block), 1.0, shading=False)[0, 0]
    assert a == pytest.approx(1 - (0.9 * 0.8) ** 4)
    assert r / a == pytest.approx(0.1 / 0.3)
    assert g / a == pytest.approx(0.2 / 0.3)


def test_the_table_is_linear_between_its_entries() -> None:
    volume = np.repeat(np.array([100, 101], np.uint8)[:, None], 12, 1)[:, :, None]
    block = block_of(np.broadcast_to(volume.transpose(2, 1, 0), (5, 12, 2)).repeat(2, 2).copy())
    assert block.channels[0].shape == (5, 12, 4)  # x: 100 100 101 101
    block.tables[0, :, 3] = 0
    block.tables[0, 101, 3] = 0.5
    a = render(block, facing(block), shading=False)[0, 0, 3]
    assert a == pytest.approx(1 - 0.75**4)  # half-way: 0.25 a voxel


def test_x_is_right_y_is_up_and_near_voxels_cover_far_ones() -> None:
    volume = np.zeros((11, 11, 11), np.uint8)
    volume[5, 2, 8] = 255  # a low row is high in the world, a high column is right
    block = block_of(volume, opacity=0.9)
    opacity = render(block, facing(block, 9, None), shading=False)[..., 3]
    assert np.argwhere(opacity == opacity.max()).tolist() == [[1, 7]]
    near, far = np.zeros((11, 11, 11), np.uint8), np.zeros((11, 11, 11), np.uint8)
    near[7:9], far[2:4] = 255, 255
    block = block_of(near, far, opacity=0.999)
    red, green = render(block, facing(block), shading=False)[0, 0, :2]
    assert red > 0.99
    assert green < 0.01


def test_perspective_keeps_a_point_where_the_field_of_view_puts_it() -> None:
    volume = np.zeros((11, 41, 41), np.uint8)
    volume[5, 20, 30] = 255
    block = block_of(volume, opacity=0.9)
    opacity = render(block, facing(block, 101, fov_deg=40.0), shading=False)[..., 3]
    row, column = np.argwhere(opacity == opacity.max())[0]
    expected = 50.5 + 50.5 * 10 / (64 * np.tan(np.deg2rad(20.0)))  # 10 um aside, 64 um away
    assert row == 50
    assert abs(column + 0.5 - expected) <= 1


@pytest.mark.slow
def test_a_wall_is_lit_by_its_angle_to_the_lamp() -> None:
    volume = np.zeros((12, 9, 9), np.uint8)
    volume[:6] = 255  # faces the eye, and is thick behind its boundary
    block = block_of(volume, opacity=0.999)
    block.tables[0, :255, 3] = 0  # only full intensity is opaque; the wall begins there
    plain = render(block, facing(block), shading=False)[0, 0]
    lit = render(block, facing(block), 0.01)[0, 0]
    lamp = 2.5 / np.linalg.norm((1.2, 1.6, 2.5))  # cosines of the angles to both lamps
    weaker = 1.8 / np.linalg.norm((1.8, 0.4, 1.8))
    gloss = 0.1 * np.cos(np.arccos(lamp) / 2) ** 16
    expected = 0.66 * (lamp + gloss) + 0.08 * weaker + (0.33 + 0.13) / 2
    # The spacing is 2 um, so intensity changes by 0.5 from 1 um before the first full voxel to 1 um
    # behind it.
    assert plain[0] == pytest.approx(plain[3])
    assert lit[0] / lit[3] == pytest.approx(expected, abs=0.02)


def test_light_is_blended_before_it_is_encoded() -> None:
    picture: Values = np.array([[[0.5 * 0.25, 0, 0, 0.25], [0, 0, 0, 0], [2, 2, 2, 1]]])
    pixels = encode(picture, (0.0, 1.0, 0.0))
    red, green = (1.055 * light ** (1 / 2.4) - 0.055 for light in (0.5 * 0.25, 0.75))
    assert pixels[0].tolist() == [
        [round(255 * red), round(255 * green), 0],
        [0, 255, 0],
        [255, 255, 255],
    ]


def test_a_page_that_adds_no_light_encodes_before_it_blends() -> None:
    picture: Values = np.array([[[0.5 * 0.25, 0, 0, 0.25], [0, 0, 0, 0], [2, 2, 2, 1]]])
    encoded = 1.055 * 0.5 ** (1 / 2.4) - 0.055
    pixels = encode(picture, (0.0, 1.0, 0.0), adds_light=False)
    assert pixels[0].tolist() == [
        [round(255 * encoded * 0.25), round(255 * 0.75), 0],
        [0, 255, 0],
        [255, 255, 255],
    ]


def test_psnr_of_a_constant_difference() -> None:
    a = np.full((4, 5, 3), 100, np.uint8)
    b = a.copy()
    b[:2] += 3
    assert psnr(a, a) == float("inf")
    inside = np.zeros((4, 5), bool)
    inside[:2] = True
    assert psnr(a, b, inside) == pytest.approx(20 * np.log10(255 / 3))
    assert psnr(a, b) == pytest.approx(20 * np.log10(255 / 3) + 10 * np.log10(2))
    with pytest.raises(ValueError, match="alike in shape"):
        psnr(a, b[:2])
