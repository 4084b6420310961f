"""Trees in a folder with a limit: the oldest are removed, the trees in use stay."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stereocell.formats.brick_stream import HASH_BYTES, encode_tree
from stereocell.formats.voxel_bvh import build
from stereocell.serve.tree_files import FullError, TreeFiles, Volume

NOISE = np.random.default_rng(3).integers(0, 255, (18, 18, 18), dtype=np.uint8)
TREE = build(NOISE, -1)
BYTES = len(encode_tree(TREE, bytes(HASH_BYTES)))  # bytes of each tree in these tests


def volume(number: int) -> Volume:
    entry: dict[str, Any] = {
        "tile": f"r0_c{number}",
        "file": {"sha256": f"{number:064x}"},
        "size": [18, 18, 18],
        "apron": 1,
        "bounds_um": {"min": [0, 0, 0], "max": [15, 15, 15]},
        "matrix": np.eye(4).ravel().tolist(),
    }
    return Volume(f"r0_c{number}", "A", entry, -1)


def make(trees: TreeFiles, number: int) -> None:
    one = volume(number)
    source = bytes.fromhex(one.source)[:HASH_BYTES]
    trees.make(one, lambda: encode_tree(TREE, source), set)


def size_of(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.iterdir())


def test_the_trees_used_longest_ago_leave_a_bounded_folder(tmp_path: Path) -> None:
    trees = TreeFiles(tmp_path / "bricks", 3 * BYTES + 10)
    for number in range(3):
        make(trees, number)
    assert trees.find(volume(0)) is not None  # so that tree 1 is the oldest
    make(trees, 3)
    assert [n for n in range(4) if trees.find(volume(n)) is not None] == [0, 2, 3]
    for number in range(4, 20):
        make(trees, number)
        assert size_of(tmp_path / "bricks") <= 3 * BYTES + 10


def test_trees_in_use_stay_and_a_tree_without_room_is_refused(tmp_path: Path) -> None:
    trees = TreeFiles(tmp_path / "bricks", 2 * BYTES)
    make(trees, 0)
    make(trees, 1)
    trees.hold("a", [volume(0), volume(1)])
    with pytest.raises(FullError, match="stays coarse"):
        make(trees, 2)
    trees.hold("b", [volume(1)])
    trees.release("a")
    make(trees, 2)
    assert [n for n in range(3) if trees.find(volume(n)) is not None] == [1, 2]
    trees.release("b")
    make(trees, 0)
    assert [n for n in range(3) if trees.find(volume(n)) is not None] == [0, 2]


def test_a_tree_that_has_left_can_be_made_again(tmp_path: Path) -> None:
    trees = TreeFiles(tmp_path / "bricks", BYTES)
    for number in (0, 1, 0):
        make(trees, number)
    assert trees.built == 3
    assert trees.find(volume(0)) is not None


def test_a_finer_tree_is_another_file_than_that_of_the_bundles_texels() -> None:
    coarse = volume(0)
    finer = replace(coarse, entry={**coarse.entry, "finer_size": [34, 34, 34]})
    assert finer.file_name != coarse.file_name
    assert (coarse.size, finer.size) == ([18, 18, 18], [34, 34, 34])
