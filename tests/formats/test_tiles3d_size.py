"""The JSON that a phone reads before the first image, for 70 channels and 242 tiles."""

import json

import numpy as np
import pytest
from jsonschema import Draft202012Validator

from stereocell.bundle.describe import describe_bundle, describe_channel
from stereocell.bundle.tile_part import BundleTile, FileRef
from stereocell.formats.tiles3d import TILESET, TileLod, make_tilesets
from stereocell.model.channel import TransferFunctions2d
from stereocell.storage.assets import schema_path
from stereocell.usd.composed_appearance import ComposedAppearance

COLUMNS, ROWS, CHANNELS, LODS = 22, 11, 70, 4
EDGE_UM = np.array([512, 512, 194]) * [0.14, 0.14, 0.28]  # x, y, z of a tile
STEP_M = 2.0**-27  # step of the lattice on which vertices lie
FIRST_PICTURE_BYTES = 300_000
FUNCTIONS = ("default", "arcs", "sharp", "soft", "surface", "threshold")


@pytest.fixture(scope="module")
def rng():
    return np.random.default_rng(0)


@pytest.fixture(scope="module")
def tiles():
    """Return bounds that are sums of spacings, with all digits of a double."""
    found = []
    for row in range(ROWS):
        for column in range(COLUMNS):
            low = EDGE_UM * [column, -(row + 1), 0]
            high = low + EDGE_UM
            corners = (tuple(map(float, low)), tuple(map(float, high)))
            found.append(BundleTile(f"r{row}_c{column}", "mesh", *corners, ()))
    return found


def lods(rng, tile):
    """Return surfaces that fill most of the tile, at realistic distances."""
    low, high = (np.array(corner) * 1e-6 for corner in (tile.low, tile.high))
    low += rng.random(3) * (high - low) / 10
    low, high = (tuple(map(float, np.rint(c / STEP_M) * STEP_M)) for c in (low, high))
    distances = np.cumsum(rng.random(LODS))
    return [
        TileLod(f"{tile.id}/lod{k}.glb", rng.bytes(32).hex(), float(distances[k]), low, high)
        for k in range(LODS)
    ]


@pytest.fixture(scope="module")
def files(rng, tiles):
    return make_tilesets([lods(rng, tile) for tile in tiles])


@pytest.fixture(scope="module")
def manifest(rng, tiles, files):
    def ref(path, size=1234):
        return FileRef(path, size, rng.bytes(32).hex())

    ramps = dict.fromkeys(FUNCTIONS, ((0.0, 0.0), (1.0, 1.0)))
    channels = []
    for k in range(CHANNELS):
        name = f"Marker_x20_{k:03}"
        low, iso, high = np.cumsum(1000 * rng.random(3)).tolist()
        window = (round(low), round(high))
        appearance = ComposedAppearance(
            name,
            name.replace("_x20_", " "),
            tuple(float(c) for c in rng.random(3).astype(np.float32)),
            window,
            window,
            iso,
            "clear",
            "default",
            ramps,
            TransferFunctions2d(gradient_max=1.0, functions={"arcs": ()}),
            iso,
        )
        entry = describe_channel(
            appearance,
            [(137_218, 38_314, 26_304, 17_454)] * len(tiles),
            [((0.0131, 0.0342), (0.0562, 0.134), (0.231, 0.517), (0.77, 1.36))] * len(tiles),
            transfer2d=ref(f"channels/{name}/transfer2d.json"),
            lut=ref(f"luts/{name}.ktx2"),
            tileset=ref(f"channels/{name}/{TILESET}", len(files[TILESET])),
            volumes=ref(f"channels/{name}/volumes.json", 290_000),
        )
        channels.append(entry)
    specimen = {"name": "70 channels", "modality": ""}
    return describe_bundle(specimen, tiles, channels=channels, index=ref("files.json", 14_000_000))


def test_the_manifest_of_70_channels_matches_its_schema(manifest, tiles):
    content = json.loads(manifest)
    schema = json.loads(schema_path("bundle.schema.json").read_text("utf-8"))
    Draft202012Validator(schema).validate(content)
    assert (len(content["tiles"]), len(content["channels"])) == (len(tiles), CHANNELS)


def test_the_first_image_waits_for_less_than_300_kb_of_json(manifest, files):
    """The phone reads the manifest, and the tileset of the first channel: see surface_set.ts."""
    first = {"manifest.json": len(manifest), TILESET: len(files[TILESET])}
    print(first, sum(first.values()))
    assert sum(first.values()) < FIRST_PICTURE_BYTES, first
