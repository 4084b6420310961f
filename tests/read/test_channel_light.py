"""Channels get the colour of their light in a plan, from tifffile, ome-types, Zeiss and Nikon."""

import json
import struct
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from ome_types.model import OME, Channel, Color, Image, Pixels, TiffData
from skimage.color import deltaE_ciede2000, rgb2lab

from stereocell.cli.__main__ import main
from stereocell.model.color import linear_color, to_srgb8
from stereocell.model.emission_color import color_of_wavelength
from stereocell.planning.channels import PALETTE
from support.array_files import write_czi
from support.nd2_files import write_nd2
from support.phantoms import f_phantom

BODY = f_phantom()
TWO = np.stack([BODY, BODY])
UM = {"PhysicalSizeX": 0.2, "PhysicalSizeY": 0.2, "PhysicalSizeZ": 0.5}


def planned_colors(path: Path) -> list[tuple[float, ...]]:
    """Return the channels' colours in the plan of a source."""
    out = path.parent / f"plan of {path.stem}"
    assert main(["plan", str(path), "-o", str(out), "--as", "intensity"]) == 0
    plan = json.loads((out / "plan.json").read_text("utf-8"))
    return [tuple(channel["color"]) for channel in plan["channels"]]


def write_ome(path: Path, channels: list[Channel]) -> Path:
    """Write an OME-TIFF with OME-XML from ome-types."""
    depth, height, width = BODY.shape
    pixels = Pixels(
        id="Pixels:0", dimension_order="XYZCT", type="uint16", size_x=width, size_y=height,
        size_z=depth, size_c=len(channels), size_t=1, channels=channels, physical_size_x=0.2,
        physical_size_y=0.2, physical_size_z=0.5,
        tiff_data_blocks=[TiffData(plane_count=depth * len(channels))],
    )  # fmt: skip
    text = OME(images=[Image(id="Image:0", pixels=pixels)]).to_xml()
    voxels = np.concatenate([BODY] * len(channels))
    tifffile.imwrite(path, voxels, description=text.encode(), metadata=None)
    return path


def test_emission_wavelengths_of_tifffile_color_the_channels(tmp_path: Path) -> None:
    path = tmp_path / "a.ome.tif"
    channels = {"Name": ["a", "b", "c"], "EmissionWavelength": [461.0, 519.0, 667.0]}
    voxels = np.stack([BODY] * 3)
    tifffile.imwrite(path, voxels, metadata={"axes": "CZYX", **UM, "Channel": channels})
    expected = [color_of_wavelength(nm) for nm in (461, 519, 667)]
    assert planned_colors(path) == expected


@pytest.mark.parametrize(
    ("about", "nm"),
    [
        ({"emission_wavelength": 519.0}, 519),
        ({"emission_wavelength": 0.519, "emission_wavelength_unit": "\u00b5m"}, 519),
        ({"fluor": "CF568"}, 583),
        ({"fluor": "Alexa Fluor 647"}, 667),
        ({"fluor": "DAPI", "emission_wavelength": 519.0}, 519),
        ({"color": Color("white"), "emission_wavelength": 519.0}, 519),
        ({"color": Color("black"), "fluor": "FITC"}, 519),
    ],
)
def test_a_channel_of_ome_xml_has_the_colour_of_its_light(
    tmp_path: Path, about: dict[str, Any], nm: float
) -> None:
    channel = Channel(id="Channel:0:0", samples_per_pixel=1, **about)
    assert planned_colors(write_ome(tmp_path / "a.ome.tif", [channel])) == [color_of_wavelength(nm)]


def test_a_stated_colour_takes_precedence_over_the_light(tmp_path: Path) -> None:
    channel = Channel(
        id="Channel:0:0", samples_per_pixel=1, color=Color("magenta"), emission_wavelength=519.0
    )
    (found,) = planned_colors(write_ome(tmp_path / "a.ome.tif", [channel]))
    assert found == linear_color((255, 0, 255))


@pytest.mark.slow
def test_channels_without_light_get_colours_that_all_eyes_distinguish(tmp_path: Path) -> None:
    """The colours come from the palette, and none repeats the colour of a dye in the file."""
    lights: list[dict[str, Any]] = [{}, {"emission_wavelength": 461.0}, {}, {}]
    channels = [
        Channel(id=f"Channel:0:{n}", samples_per_pixel=1, name=f"m{n}", **about)
        for n, about in enumerate(lights)
    ]
    found = planned_colors(write_ome(tmp_path / "a.ome.tif", channels))
    assert all(color in PALETTE for color in (found[0], *found[2:]))
    lab = rgb2lab(to_srgb8(np.array(found, np.float32)))
    pairs = combinations(range(len(found)), 2)
    assert min(float(deltaE_ciede2000(lab[a], lab[b])) for a, b in pairs) > 8
    bare = [Channel(id=f"Channel:0:{n}", samples_per_pixel=1, name=f"m{n}") for n in range(3)]
    assert planned_colors(write_ome(tmp_path / "b.ome.tif", bare)) == list(PALETTE[:3])


def with_lights(path: Path, lights: list[tuple[str, float]]) -> Path:
    """Append metadata with dyes and wavelengths (nm) to a CZI, in the form of Zeiss's library."""
    content = bytearray(path.read_bytes())
    (at,) = struct.unpack_from("<q", content, 92)  # MetadataPosition in the file's header
    (size,) = struct.unpack_from("<i", content, at + 32)
    text = content[at + 32 + 256 : at + 32 + 256 + size].decode("utf-8")
    for number, (dye, nm) in enumerate(lights):
        start = text.index(f'Id="Channel:{number}"', text.index("<Dimensions>"))
        end = text.index(">", start)
        is_empty = text[end - 1] == "/"
        inner = f"<Fluor>{dye}</Fluor><EmissionWavelength>{nm}</EmissionWavelength>"
        opened = text[: end - is_empty] + ">" + inner + "</Channel>" * is_empty
        text = opened + text[end + 1 :]
    xml = text.encode("utf-8")
    data = struct.pack("<ii", len(xml), 0) + bytes(248) + xml
    padded = -(-len(data) // 32) * 32
    head = b"ZISRAWMETADATA".ljust(16, b"\0") + struct.pack("<qq", padded, len(data))
    content[92:100] = struct.pack("<q", len(content))
    path.write_bytes(bytes(content) + head + data.ljust(padded, b"\0"))
    return path


def test_wavelengths_and_dyes_of_czi_color_the_channels(tmp_path: Path) -> None:
    path = write_czi(tmp_path / "a.czi", {None: TWO[None]})
    found = planned_colors(with_lights(path, [("", 519), ("Alexa Fluor 594", 0)]))
    assert found == [color_of_wavelength(519), color_of_wavelength(610)]


@pytest.mark.slow
def test_emission_spectra_of_nd2_color_channels_that_state_none(tmp_path: Path) -> None:
    path = tmp_path / "a.nd2"
    lights = {0: 667.0, 1: 519.0}
    write_nd2(path, TWO.transpose(1, 0, 2, 3)[None, None], (0.5, 0.2, 0.2), lights=lights)
    assert planned_colors(path) == [color_of_wavelength(667), color_of_wavelength(519)]
