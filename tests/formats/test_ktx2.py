import io
import struct

import alktx2
import numpy as np
import pytest
import zstandard
from PIL import Image

from stereocell.filters.min_max_bricks import mip_levels
from stereocell.formats.basis_textures import encode_normal_map
from stereocell.formats.ktx2 import encode_2d, encode_3d
from support.ktx2_parser import parse


@pytest.fixture
def volume():
    return np.random.default_rng(1).integers(0, 255, (9, 33, 20), dtype=np.uint8)


def test_a_volume_is_read_back_level_by_level(volume):
    levels = mip_levels(volume)
    texture = encode_3d(levels)
    header, index, _, _ = parse(texture.data)
    assert (header["width"], header["height"], header["depth"]) == (20, 33, 9)
    assert header["format"] == 9  # VK_FORMAT_R8_UNORM
    assert (header["type_size"], header["layers"], header["faces"]) == (1, 0, 1)
    assert header["scheme"] == 2  # zstd
    for level, (offset, length, plain), place in zip(levels, index, texture.levels, strict=True):
        frame = texture.data[offset : offset + length]
        assert plain == level.size
        assert zstandard.get_frame_parameters(frame).content_size == level.size
        assert zstandard.decompress(frame) == level.tobytes()
        assert (place.offset, place.length, place.size) == (offset, length, level.shape[::-1])


def test_the_smallest_level_is_first_and_every_byte_is_used(volume):
    data = encode_3d(mip_levels(volume)).data
    _, index, _, key_values = parse(data)
    end = data.index(key_values) + len(key_values)
    for offset, length, _ in reversed(index):
        assert offset == end
        end += length
    assert end == len(data)


@pytest.mark.parametrize(("components", "vk_format"), [(1, 9), (2, 16), (4, 37)])
def test_the_descriptor_states_every_component(components, vk_format):
    data = encode_2d(np.zeros((3, 5, components), np.uint8)).data
    header, _, descriptor, _ = parse(data)
    assert header["format"] == vk_format
    assert header["depth"] == 0
    size = 24 + 16 * components
    assert struct.unpack_from("<IIHH", descriptor) == (size + 4, 0, 2, size)
    assert tuple(descriptor[12:16]) == (1, 1, 1, 0)  # RGBSDA, BT.709, linear, straight alpha
    assert tuple(descriptor[16:28]) == (0, 0, 0, 0, components, 0, 0, 0, 0, 0, 0, 0)
    for i, channel in enumerate((0, 1, 2, 15)[:components]):
        sample = struct.unpack_from("<HBBIII", descriptor, 28 + 16 * i)
        assert sample == (8 * i, 7, channel, 0, 0, 255)


def read_pairs(key_values):
    """Return keys and values as in the file: sorted, each padded to four bytes."""
    pairs = []
    while key_values:
        (length,) = struct.unpack_from("<I", key_values)
        key, value, end = key_values[4 : 4 + length].split(b"\0")
        assert end == b""
        pairs.append((key.decode(), value.decode()))
        assert not any(key_values[4 + length : 4 + -(-length // 4) * 4])
        key_values = key_values[4 + -(-length // 4) * 4 :]
    return pairs


def test_writer_and_orientation_are_named(volume):
    _, _, _, key_values = parse(encode_3d([volume]).data)
    assert len(key_values) % 4 == 0
    (first, orientation), (second, writer) = read_pairs(key_values)
    assert (first, second) == ("KTXorientation", "KTXwriter")
    assert orientation == "rdo"  # right, down, towards the viewer
    assert writer.startswith("stereocell ")
    _, _, _, key_values = parse(encode_2d(np.zeros((3, 5, 4), np.uint8)).data)
    assert read_pairs(key_values)[0] == ("KTXorientation", "rd")


def test_the_same_volume_gives_the_same_bytes(volume):
    assert encode_3d([volume]).data == encode_3d([volume.copy()]).data


def test_a_non_contiguous_volume_is_written_in_its_logical_order(volume):
    assert encode_3d([volume[::-1, :, ::2]]).data == encode_3d([volume[::-1, :, ::2].copy()]).data


def test_a_level_of_wrong_size_is_refused(volume):
    with pytest.raises(ValueError, match=r"level 1 is .* not \(4, 16, 10, 1\)"):
        encode_3d([volume, volume[::3, ::3, ::3]])


def test_a_normal_map_keeps_its_normals_and_always_has_the_same_bytes():
    y, x = np.mgrid[0:64, 0:64] / 32 - 1
    normals = np.stack([0.5 * np.sin(3 * x), 0.5 * np.cos(2 * y), np.ones_like(x)], -1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    image = np.rint(normals * 127.5 + 127.5).astype(np.uint8)
    data = encode_normal_map(image)
    assert data == encode_normal_map(image.copy())
    header, _, descriptor, _ = parse(data)
    assert (header["format"], header["width"], header["height"]) == (0, 64, 64)
    assert header["levels"] == 7
    assert tuple(descriptor[12:15]) == (166, 1, 1)  # UASTC, BT.709, linear
    picture, _ = alktx2.decode_ktx2_to_bytes(data, format="png")
    decoded = np.asarray(Image.open(io.BytesIO(picture)))[..., :3] / 127.5 - 1
    decoded /= np.linalg.norm(decoded, axis=-1, keepdims=True)
    angle = np.degrees(np.arccos(np.clip((decoded * normals).sum(-1), -1, 1)))
    assert angle.mean() < 0.7


def test_a_normal_map_of_odd_size_is_refused():
    with pytest.raises(ValueError, match="a baked map of 30 x 32 x 3"):
        encode_normal_map(np.zeros((32, 30, 3), np.uint8))
