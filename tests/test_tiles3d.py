import base64
import hashlib

import pytest

from stereocell.write.tiles3d import TileLod, content_hash, make_tileset

ABC = hashlib.sha256(b"abc").hexdigest()  # ba7816bf8f01cfea414140de5dae2223...


def lods(x0, distances):
    return [
        TileLod(
            f"t{x0}/lod{k}.glb", ABC, d, (x0 * 1e-6, -4e-6, 1e-6), ((x0 + 10) * 1e-6, -1e-6, 3e-6)
        )
        for k, d in enumerate(distances)
    ]


def test_coarse_lods_come_first_and_errors_are_measured_distances_in_metres():
    root = make_tileset([lods(0, [0.02, 0.1, 0.5])])["root"]
    tile, seen = root["children"][0], []
    while True:
        seen.append((tile["content"]["uri"], tile["geometricError"]))
        if "children" not in tile:
            break
        (tile,) = tile["children"]
    assert [uri for uri, _ in seen] == ["t0/lod2.glb", "t0/lod1.glb", "t0/lod0.glb"]
    assert [error for _, error in seen] == pytest.approx([0.5e-6, 0.1e-6, 0])


def test_errors_never_grow_towards_the_leaves():
    root = make_tileset([lods(0, [0.02, 0.3, 0.1])])["root"]
    coarsest = root["children"][0]
    assert coarsest["geometricError"] == coarsest["children"][0]["geometricError"]
    assert root["geometricError"] > coarsest["geometricError"]


def test_boxes_are_turned_z_up():
    box = make_tileset([lods(0, [0])])["root"]["boundingVolume"]["box"]
    # glTF centre (5, -2.5, 2), half size (5, 1.5, 1) um -> (x, -z, y)
    assert [n * 1e6 for n in box] == pytest.approx([5, -2, -2.5, 5, 0, 0, 0, 1, 0, 0, 0, 1.5])


def test_contents_give_the_first_128_bits_of_their_hash():
    assert content_hash(ABC) == "ungWv48Bz-pBQUDeXa4iIw"
    assert base64.urlsafe_b64decode(content_hash(ABC) + "==") == bytes.fromhex(ABC)[:16]
    (tile,) = make_tileset([lods(0, [0])])["root"]["children"]
    assert tile["content"]["extras"] == {"sha-256-128": content_hash(ABC)}


def test_root_holds_every_tile_and_has_no_content():
    tileset = make_tileset([lods(0, [0]), lods(20, [0])])
    root = tileset["root"]
    assert tileset["asset"]["version"] == "1.1"
    assert "content" not in root
    assert len(root["children"]) == 2
    assert [n * 1e6 for n in root["boundingVolume"]["box"][:4]] == pytest.approx([15, -2, -2.5, 15])
