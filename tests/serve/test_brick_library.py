"""Trees of a bundle are built once, stored, and built again if something is damaged or changed."""

import json
import os
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from stereocell.formats.ktx2 import decode_finest, encode_2d, encode_3d
from stereocell.formats.voxel_bvh import build
from stereocell.model.errors import OutputError, SourceError, StereoCellError
from stereocell.serve import tree_files
from stereocell.serve.brick_library import BrickLibrary, UnknownVolumeError
from stereocell.transfer.opacity import invisible_below
from support.server.brick_bundles import (
    phantom,
    replace_transfer_functions,
    replace_volume,
    write_out,
)

VOLUME = phantom()


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    return write_out(tmp_path_factory.mktemp("library") / "out", VOLUME)


@pytest.fixture
def out(written, tmp_path):
    return shutil.copytree(written, tmp_path / "out")


def library(out):
    return BrickLibrary(out / "bundle", out / "bricks")


def test_a_tree_is_that_of_the_bundles_volume(out):
    file = library(out).open("r0_c0", "CD31")
    expected = build(VOLUME, file.table.threshold)
    for name in expected.nodes.dtype.names:
        np.testing.assert_array_equal(file.table.nodes[name], expected.nodes[name])
    entry = json.loads((out / "bundle/channels/CD31/volumes.json").read_text("utf-8"))["volumes"][0]
    assert file.volume.source == entry["file"]["sha256"]
    assert file.table.source.hex() == entry["file"]["sha256"][:32]


def test_threshold_is_the_largest_value_that_a_function_leaves_invisible():
    row = np.zeros((256, 4), np.uint8)
    row[:, :3] = 255
    assert invisible_below(row[:, 3]) == 254
    row[100:, 3] = 9
    assert invisible_below(row[:, 3]) == 99
    row[40:50, 3] = 1
    assert invisible_below(row[:, 3]) == 39
    row[0, 3] = 1
    assert invisible_below(row[:, 3]) == -1


@pytest.mark.parametrize(("chosen", "threshold"), [("default", 99), ("sharp", 199), ("soft", -1)])
def test_trees_use_the_function_that_the_stage_opens_with(out, chosen, threshold):
    """A function that hides dark values, like `sharp`, needs no brick of them; `soft` needs all."""
    opacities = np.zeros((3, 256))
    opacities[0, 100:] = opacities[1, 200:] = opacities[2] = 0.5
    names = ["default", "sharp", "soft"]
    replace_transfer_functions(out / "bundle", opacities, names=names, chosen=chosen)
    files = library(out)
    assert files.volumes()["r0_c0", "CD31"].threshold == threshold
    assert files.open("r0_c0", "CD31").table.threshold == threshold
    expected = build(VOLUME, threshold)
    assert len(files.open("r0_c0", "CD31").table.nodes) == len(expected.nodes)


def test_a_table_of_other_functions_than_the_manifest_s_is_one_line(out):
    replace_transfer_functions(out / "bundle", np.zeros((3, 256)), names=["default", "soft"])
    with pytest.raises(SourceError, match="expected 2 rows of 256 RGBA"):
        library(out).volumes()
    names = ["default", "soft", "sharp"]
    replace_transfer_functions(out / "bundle", np.zeros((3, 256)), names=names, chosen="arcs")
    with pytest.raises(SourceError, match="arcs is none of default, soft, sharp"):
        library(out).volumes()


def test_a_second_start_builds_nothing(out):
    first = library(out)
    first.open("r0_c0", "CD31")
    first.open("r0_c0", "CD31")
    assert first.built == 1
    second = library(out)
    assert second.open("r0_c0", "CD31").table_hash == first.open("r0_c0", "CD31").table_hash
    assert second.built == 0


@pytest.mark.parametrize("spoil", ["cut", "header", "empty", "other", "brick"])
def test_a_damaged_tree_is_built_again(out, spoil):
    before = library(out).open("r0_c0", "CD31").table_hash
    (path,) = (out / "bricks").glob("*.bvh")
    data = bytearray(path.read_bytes())
    if spoil == "cut":
        del data[-1:]
    elif spoil == "header":
        data[28] ^= 255
    elif spoil == "brick":
        data[-1] ^= 1
    elif spoil == "other":
        data[48] ^= 1  # the tree's file then states the hash of another volume
    path.write_bytes(b"" if spoil == "empty" else data)
    again = library(out)
    assert again.open("r0_c0", "CD31").table_hash == before
    assert again.built == 1


def test_another_volume_gets_another_tree_and_the_old_ones_go(out):
    one = library(out)
    before = one.open("r0_c0", "CD31").table_hash
    replace_volume(out / "bundle", 255 - VOLUME)
    assert one.open("r0_c0", "CD31").table_hash != before
    assert len(list((out / "bricks").glob("*.bvh"))) == 1


def test_nothing_but_trees_is_left_in_the_folder(out):
    library(out).open("r0_c0", "CD31")
    assert [p.suffix for p in (out / "bricks").iterdir()] == [".bvh"]


def test_a_volume_that_the_bundle_lacks_is_named(out):
    with pytest.raises(UnknownVolumeError, match="no volume of tile r9_c9, channel CD31"):
        library(out).open("r9_c9", "CD31")


def test_a_damaged_volume_gives_one_line_that_names_it(out):
    path = out / "bundle/volumes/r0_c0/CD31.ktx2"
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(SourceError, match=r"CD31\.ktx2: its SHA-256 is not"):
        library(out).open("r0_c0", "CD31")
    path.unlink()
    with pytest.raises(SourceError, match=r"CD31\.ktx2: No such file"):
        library(out).open("r0_c0", "CD31")
    (out / "bundle/manifest.json").write_text("{}")
    with pytest.raises(OutputError, match=r"manifest\.json"):
        library(out).volumes()


def test_bricks_are_read_from_the_file(out):
    file = library(out).open("r0_c0", "CD31")
    stored = np.flatnonzero(file.table.nodes["length"])
    (path,) = (out / "bricks").glob("*.bvh")
    data = path.read_bytes()[file.table.bytes :]
    assert b"".join(file.read(stored.tolist())) == data
    assert file.read([int(stored[-1])])[0] == data[-int(file.table.nodes["length"][stored[-1]]) :]


def test_bricks_are_read_without_pread_too(out, monkeypatch):
    file = library(out).open("r0_c0", "CD31")
    nodes = np.flatnonzero(file.table.nodes["length"]).tolist()
    bricks = file.read(nodes)
    monkeypatch.setattr(tree_files, "sys", SimpleNamespace(platform="win32"))
    monkeypatch.delattr(os, "pread")
    assert file.read(nodes) == bricks
    assert len(set(bricks)) > 1


def test_an_old_tree_that_is_open_is_left_for_the_next_time(out, monkeypatch):
    library(out).open("r0_c0", "CD31")
    (old,) = (out / "bricks").iterdir()
    replace_volume(out / "bundle", 255 - VOLUME)

    unlink = Path.unlink

    def refuse(path, missing_ok=False):
        if path == old:
            raise PermissionError(13, "it is open", str(path))
        unlink(path, missing_ok)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", refuse)
        library(out).open("r0_c0", "CD31")
    assert old.exists()


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_cant_be_written_is_one_line(out):
    (out / "bricks").mkdir()
    (out / "bricks").chmod(0o500)
    with pytest.raises(StereoCellError, match="can't be written"):
        library(out).open("r0_c0", "CD31")


def test_textures_come_back():
    image = np.random.default_rng(1).integers(0, 255, (3, 256, 4), dtype=np.uint8)
    np.testing.assert_array_equal(decode_finest(encode_2d(image).data)[0], image)
    np.testing.assert_array_equal(decode_finest(encode_3d([VOLUME]).data)[..., 0], VOLUME)


@pytest.mark.parametrize("at", [0, 12, 20, 24, 28, 32, 36, 44, 80, 88, 96])
def test_a_damaged_texture_is_refused(at):
    data = bytearray(encode_3d([VOLUME]).data)
    data[at : at + 4] = b"\xff\xff\xff\xff"
    with pytest.raises(SourceError):
        decode_finest(bytes(data))
    with pytest.raises(SourceError):
        decode_finest(bytes(data[:at]))
