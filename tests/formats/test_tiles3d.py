import base64
import hashlib
import json

import pytest

from stereocell.formats.tiles3d import (
    MAX_WHOLE_TILES,
    TILESET,
    TileLod,
    content_hash,
    make_tilesets,
)

ABC = hashlib.sha256(b"abc").hexdigest()  # ba7816bf8f01cfea414140de5dae2223...
NM = 1e-9


def lods(x0, distances):
    return [
        TileLod(
            f"t{x0}/lod{k}.glb", ABC, d, (x0 * 1e-6, -4e-6, 1e-6), ((x0 + 10) * 1e-6, -1e-6, 3e-6)
        )
        for k, d in enumerate(distances)
    ]


def whole(tiles):
    """Return the only file for a few tiles."""
    (text,) = make_tilesets(tiles).values()
    return json.loads(text)


def chain(tile):
    """Return a tile and all below it, each the only child of the one before."""
    found = [tile]
    while "children" in found[-1]:
        (child,) = found[-1]["children"]
        found.append(child)
    return found


@pytest.fixture(scope="module")
def many():
    """Return files for more tiles than one file describes; the last tile has one LOD."""
    tiles = [lods(20 * n, [0.02, 0.1, 0.5]) for n in range(MAX_WHOLE_TILES)]
    files = make_tilesets([*tiles, lods(20 * MAX_WHOLE_TILES, [0])])
    return {address: json.loads(text) for address, text in files.items()}, files


def test_coarse_lods_are_first_and_errors_are_measured_distances_in_metres():
    levels = chain(whole([lods(0, [0.02, 0.1, 0.5])])["root"]["children"][0])
    uris = [tile["content"]["uri"] for tile in levels]
    assert uris == ["t0/lod2.glb", "t0/lod1.glb", "t0/lod0.glb"]
    assert [tile["geometricError"] for tile in levels] == pytest.approx([0.5e-6, 0.1e-6, 0])


def test_errors_never_grow_towards_the_leaves():
    root = whole([lods(0, [0.02, 0.3, 0.1])])["root"]
    coarsest = root["children"][0]
    assert coarsest["geometricError"] == coarsest["children"][0]["geometricError"]
    assert root["geometricError"] > coarsest["geometricError"]


@pytest.mark.parametrize("distance", [0.123456789, 1 / 3, 1234567.0, 1e-30, 9.9999999])
def test_errors_keep_four_digits_and_are_never_smaller_than_the_distance(distance):
    levels = chain(whole([lods(0, [0, distance])])["root"]["children"][0])
    error = levels[0]["geometricError"]
    assert distance * 1e-6 <= error <= distance * 1e-6 * 1.001
    assert float(f"{error:.3e}") == error


def test_boxes_are_turned_z_up():
    box = whole([lods(0, [0])])["root"]["boundingVolume"]["box"]
    # glTF centre (5, -2.5, 2), half size (5, 1.5, 1) um -> (x, -z, y)
    assert [n * 1e6 for n in box] == pytest.approx(
        [5, -2, -2.5, 5, 0, 0, 0, 1, 0, 0, 0, 1.5], abs=1.5e-3
    )


def test_boxes_are_rounded_outwards_to_whole_nanometres():
    low, high = (1.00012345e-3, -7.7777777e-5, 3.3333333e-6), (1.0009e-3, -1e-9, 5.5555555e-6)
    tile = whole([[TileLod("t/lod0.glb", ABC, 0, low, high)]])["root"]["children"][0]
    box = tile["boundingVolume"]["box"]
    assert [float(f"{n:.9f}") for n in box] == box
    for axis, half, (a, b) in (
        (0, 3, (low[0], high[0])),
        (1, 7, (-high[2], -low[2])),
        (2, 11, (low[1], high[1])),
    ):
        assert a - 2 * NM <= box[axis] - box[half] <= a + 1e-18
        assert b - 1e-18 <= box[axis] + box[half] <= b + 2.01 * NM


def test_the_root_s_box_contains_those_of_the_tiles():
    boxes = [(0.0, 3.4e-9), (1.2e-9, 6.5e-9), (-2.5e-9, 0.1e-9)]
    tiles = [
        [TileLod(f"t{n}/lod0.glb", ABC, 0, (a, a, a), (b, b, b))] for n, (a, b) in enumerate(boxes)
    ]
    root = whole(tiles)["root"]

    def ends(tile):
        box = tile["boundingVolume"]["box"]
        return [
            (round((c - h) / NM), round((c + h) / NM))
            for c, h in zip(box[:3], box[3::4], strict=True)
        ]

    for tile in root["children"]:
        for (low, high), (lowest, highest) in zip(ends(tile), ends(root), strict=True):
            assert lowest <= low < high <= highest


def test_contents_state_the_first_128_bits_of_their_hash():
    assert content_hash(ABC) == "ungWv48Bz-pBQUDeXa4iIw"
    assert base64.urlsafe_b64decode(content_hash(ABC) + "==") == bytes.fromhex(ABC)[:16]
    (tile,) = whole([lods(0, [0])])["root"]["children"]
    assert tile["content"]["extras"] == {"sha-256-128": content_hash(ABC)}


def test_the_root_contains_every_tile_and_has_no_content():
    tileset = whole([lods(0, [0]), lods(20, [0])])
    root = tileset["root"]
    assert tileset["asset"]["version"] == "1.1"
    assert "content" not in root
    assert len(root["children"]) == 2
    middle = [15, -2, -2.5, 15]
    assert [n * 1e6 for n in root["boundingVolume"]["box"][:4]] == pytest.approx(middle, abs=1.5e-3)


def test_refinement_is_stated_at_roots_and_inherited_below(many):
    for tileset in many[0].values():
        assert tileset["root"]["refine"] == "REPLACE"
        waiting = list(tileset["root"].get("children", ()))
        while waiting:
            tile = waiting.pop()
            assert "refine" not in tile
            waiting += tile.get("children", ())


def test_tiles_up_to_the_limit_are_in_one_file():
    tiles = [lods(n, [0, 0.1]) for n in range(MAX_WHOLE_TILES)]
    assert list(make_tilesets(tiles)) == [TILESET]
    assert len(make_tilesets([*tiles, lods(99, [0, 0.1])])) == 2 + MAX_WHOLE_TILES


def test_the_finer_levels_of_many_tiles_are_in_separate_files(many):
    contents, files = many
    assert next(iter(files)) == TILESET
    *with_finer, alone = contents[TILESET]["root"]["children"]
    assert chain(alone) == [alone]
    assert alone["content"]["uri"].endswith("/lod0.glb")
    for n, tile in enumerate(with_finer):
        coarsest, holder = chain(tile)
        address = f"t{20 * n}/finer.json"
        assert coarsest["content"]["uri"] == f"t{20 * n}/lod2.glb"
        assert holder["content"]["uri"] == address
        hashed = content_hash(hashlib.sha256(files[address]).hexdigest())
        assert holder["content"]["extras"] == {"sha-256-128": hashed}
        # Error and box are those of the coarsest surface, which is drawn until the file arrives.
        assert holder["geometricError"] == coarsest["geometricError"]
        assert holder["boundingVolume"] == coarsest["boundingVolume"]
    assert len(files) == 1 + len(with_finer)


def test_an_external_tileset_addresses_surfaces_from_its_own_folder(many):
    contents, _ = many
    finer = contents["t0/finer.json"]
    levels = chain(finer["root"])
    assert [tile["content"]["uri"] for tile in levels] == ["lod1.glb", "lod0.glb"]
    assert [tile["geometricError"] for tile in levels] == pytest.approx([0.1e-6, 0])
    assert finer["geometricError"] == pytest.approx(0.5e-6)
    assert finer["asset"]["version"] == "1.1"
