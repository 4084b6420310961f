import json
import re
import shutil
import subprocess
from types import SimpleNamespace

import pytest

from stereocell.building.out_folder import OutFolder
from stereocell.cli.__main__ import main
from stereocell.engine.run import Engine
from stereocell.formats.stl import write_stl
from stereocell.model.errors import OutputError
from stereocell.planning import settings as settings_module
from stereocell.planning.channels import Channel
from stereocell.planning.plan import make_plan
from stereocell.read import Level
from stereocell.storage.assets import find_asset
from stereocell.usd.write_stage import TileExtent, write_stage, write_tile
from stereocell.usd.written_files import write_list
from stereocell.verify import node_validators
from stereocell.verify.formats import check
from support import object_bundle, spheres
from support.bundles import write_bundle
from support.sealed_files import edit_sealed

GLB = "channels/CD31/r0_c0/lod0.glb"
VOLUME = "volumes/r0_c0/CD31.ktx2"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    out = tmp_path_factory.mktemp("out")
    spheres.write_one_tile(out / "stage")
    write_list(out / "stage", {}, out / "stage")
    write_bundle(out / "stage" / "stage.usda", out / "bundle", None, engine=Engine(0))
    return out


@pytest.fixture
def out(made, tmp_path):
    """A copy that a test may damage."""
    return shutil.copytree(made, tmp_path / "out")


def lines(out):
    return {line.name: line for line in check(out)}


def failed(found):
    """Names of the checks that fail. The plan is left out, because these folders have none."""
    return {name for name, line in found.items() if not line.ok} - {"plan"}


def change_byte(path):
    """Change one byte near the file's end; its length stays."""
    data = bytearray(path.read_bytes())
    data[-40] ^= 1
    path.write_bytes(data)


@pytest.fixture(scope="module")
def node():
    """Skip where node or its packages are missing; `make test` installs them."""
    packages = find_asset("viewer_gltf/tools").parent / "node_modules"
    if shutil.which("node") is None or not (packages / "gltf-validator").is_dir():
        pytest.skip("needs Node 20 and its packages: `make setup`")


@pytest.fixture(autouse=True)
def node_finds_nothing(request, monkeypatch):
    """Let node's validators find no fault, except in tests that use `node`, which starts slowly."""
    if "node" not in request.fixturenames:
        answer = subprocess.CompletedProcess([], 0, "[]", "")
        monkeypatch.setattr(node_validators, "subprocess", SimpleNamespace(**vars(subprocess)))
        monkeypatch.setattr(node_validators.subprocess, "run", lambda *args, **options: answer)


@pytest.mark.slow
@pytest.mark.usefixtures("node")
def test_files_that_the_pipeline_writes_pass_all_checks(made):
    found = lines(made)
    assert failed(found) == set()
    assert found["glTF validator"].detail == "3 files"


@pytest.mark.slow
def test_checks_that_need_no_node_pass(made):
    found = lines(made)
    assert failed(found) <= {"glTF validator", "KTX2 textures"}


@pytest.mark.parametrize("name", [".", "missing"])
def test_a_folder_without_a_build_is_one_error(tmp_path, name):
    with pytest.raises(
        OutputError, match=r"found no build, expected plan\.json, stage/ and bundle/, or a bundle's"
    ):
        lines(tmp_path / name)


@pytest.mark.slow
@pytest.mark.usefixtures("node")
def test_a_bundle_by_itself_is_checked_as_in_its_build(out):
    whole, alone = lines(out), lines(out / "bundle")
    assert alone == {name: whole[name] for name in alone}
    assert set(whole) - set(alone) == {"plan", "stage hashes", "stage", "stage files", "usdz"}
    change_byte(out / "bundle" / VOLUME)
    found = lines(out / "bundle")
    assert "hashes" in failed(found)


def test_a_bundle_without_its_build_has_no_source_to_compare_with(out, capfd):
    assert main(["check", str(out / "bundle"), "--deep", "--workers", "0"]) == 1
    *_, last = capfd.readouterr().err.splitlines()
    assert "plan.json" in last


def test_a_build_without_anything_in_it_fails_in_every_line(tmp_path):
    (tmp_path / "bundle").mkdir()
    found = lines(tmp_path)
    assert not any(line.ok for line in found.values())
    assert "is missing" in found["manifest"].detail
    assert all("\n" not in line.detail for line in found.values())


@pytest.mark.parametrize("name", [GLB, VOLUME])
def test_changed_byte_is_found(out, name):
    change_byte(out / "bundle" / name)
    found = lines(out)
    assert "hashes" in failed(found)
    assert f"{name}: its size or hash differs" in found["hashes"].detail


def test_a_changed_byte_of_a_surface_contradicts_its_tileset(out):
    change_byte(out / "bundle" / GLB)
    found = lines(out)
    assert "tilesets" in failed(found)
    detail = found["tilesets"].detail
    assert "CD31/tileset.json: r0_c0/lod0.glb: found sha-256-128 " in detail
    assert "lod1.glb" not in detail


def test_a_changed_byte_of_a_resolution_level_contradicts_the_hash_in_volumes_json(out):
    """The changed byte belongs to the finest resolution level, which lies last in the file."""
    change_byte(out / "bundle" / VOLUME)
    found = lines(out)
    assert "volume lists" in failed(found)
    detail = found["volume lists"].detail
    assert f"{VOLUME}: resolution level 0: found SHA-256 " in detail
    assert "level 1" not in detail


def test_surface_without_a_hash_is_found(out):
    path = out / "bundle" / "channels/CD31/tileset.json"
    path.write_text(path.read_text("utf-8").replace("sha-256-128", "md5", 1))
    found = lines(out)
    assert "found no hash, expected extras.sha-256-128" in found["tilesets"].detail


def test_resolution_level_without_a_hash_is_found(out):
    path = out / "bundle" / "channels/CD31/volumes.json"
    path.write_text(
        re.sub(r'("length":\d+),"sha256":"\w+"', r"\1", path.read_text("utf-8"), count=1)
    )
    found = lines(out)
    assert "'sha256' is a required property" in found["volume lists"].detail


def test_missing_and_unlisted_files_are_found(out):
    (out / "bundle" / GLB).rename(out / "bundle" / "lost.glb")
    found = lines(out)
    assert {"hashes", "tilesets"} <= failed(found)
    assert f"{GLB}: missing" in found["hashes"].detail
    assert "lost.glb: found a file that files.json does not list" in found["hashes"].detail
    assert "no file at r0_c0/lod0.glb" in found["tilesets"].detail


def test_reference_to_other_bytes_is_found(out):
    edit_sealed(out / "bundle" / "manifest.json", lambda m: m["files"].update(sha256="0" * 64))
    found = lines(out)
    assert "hashes" in failed(found)


def test_unknown_version_is_found(out):
    edit_sealed(out / "bundle" / "manifest.json", lambda manifest: manifest.update(version=2))
    found = lines(out)
    assert found["manifest"].detail.count("$.version: 1 was expected") == 1


def test_broken_json_is_found(out):
    (out / "bundle" / "files.json").write_text("{")
    found = lines(out)
    assert "not JSON" in found["file list"].detail


def test_level_that_lies_elsewhere_is_found(out):
    path = out / "bundle" / "channels/CD31/volumes.json"
    text = path.read_text("utf-8")
    offset = text.split('"offset":')[1].split(",")[0]
    path.write_text(text.replace(f'"offset":{offset}', f'"offset":{int(offset) + 1}', 1))
    found = lines(out)
    assert "found other offsets of resolution levels" in found["volume lists"].detail


def test_tileset_whose_errors_grow_is_found(out):
    path = out / "bundle" / "channels/CD31/tileset.json"
    path.write_text(path.read_text("utf-8").replace('"geometricError":0.0', '"geometricError":9.0'))
    found = lines(out)
    assert "geometricError is 9, expected at most" in found["tilesets"].detail


@pytest.mark.slow
@pytest.mark.usefixtures("node")
def test_a_build_without_any_surface_passes(tmp_path):
    tile = spheres.tile(0, (spheres.BLUE,))
    write_tile(tmp_path / "stage", tile)
    write_stage(
        tmp_path / "stage",
        "empty",
        appearances=[spheres.BLUE],
        tiles=[TileExtent.of(tile)],
        provenance={},
    )
    write_list(tmp_path / "stage", {}, tmp_path / "stage")
    write_bundle(tmp_path / "stage" / "stage.usda", tmp_path / "bundle", None, engine=Engine(0))
    found = lines(tmp_path)
    assert failed(found) == set()
    assert found["glTF validator"].detail == "0 files: no channel has a surface"


def test_lost_meshes_are_not_taken_for_a_build_without_any_surface(out):
    for path in (out / "bundle").rglob("*.glb"):
        path.unlink()
    found = lines(out)
    assert "glTF validator" in failed(found)


@pytest.mark.parametrize(
    "path", ["tiles/r0_c0/CD31.vdb", "tiles/r0_c0/CD31.exr", "looks/CD31_default.exr"]
)
def test_cut_file_of_the_stage_is_found(out, path, capfd):
    damaged = out / "stage" / path
    damaged.write_bytes(damaged.read_bytes()[:-20])
    found = lines(out)
    assert "stage files" in failed(found)
    assert f"{path}: can't be read as" in found["stage files"].detail
    assert capfd.readouterr().err == ""


@pytest.fixture
def with_copies(out):
    """A build whose plan asks for closed copies: of CD31, which has a surface."""
    settings = settings_module.load(None, None, flags={"surface": {"closed_tiles": True}})
    channels = tuple(
        Channel(k, name, (1, 0, 0)) for k, name in enumerate(("CD31", "Hoechst 33342"))
    )
    level = Level((8, 8, 8), (1.0, 1.0, 1.0))
    plan = make_plan(
        "in",
        "in",
        fingerprint="ab" * 32,
        levels=(level,),
        origin_um=(0.0, 0.0, 0.0),
        channels=channels,
        level=(0, "asked for"),
        settings=settings,
        formats=["ome-zarr"],
    )
    OutFolder(out).save_plan(plan)
    copy = out / "stage" / "tiles" / "r0_c0" / "CD31_closed.stl"
    write_stl(copy, spheres.tile(0).channels[0].lods[0].mesh)
    return copy


def test_closed_copies_are_counted(out, with_copies):
    line = lines(out)["stage files"]
    assert line.ok, line.detail
    assert line.detail.endswith("and 1 closed .stl are whole")


def test_cut_closed_copy_is_found(out, with_copies):
    data = with_copies.read_bytes()
    with_copies.write_bytes(data[:-50])
    found = lines(out)
    detail = found["stage files"].detail
    assert f"CD31_closed.stl: can't be read as STL: {len(data) - 50} bytes, expected" in detail
    with_copies.write_bytes(data[:60])
    found = lines(out)
    assert "its header was cut short" in found["stage files"].detail


def test_lost_closed_copy_is_found(out, with_copies):
    with_copies.unlink()
    found = lines(out)
    detail = found["stage files"].detail
    assert detail.startswith(f"{with_copies}: missing, expected because surface.closed_tiles is on")
    assert "Hoechst" not in detail


def test_stage_with_a_lost_file_is_found(out):
    (out / "stage" / "tiles" / "r0_c0" / "CD31.vdb").unlink()
    found = lines(out)
    assert "CD31.vdb" in found["stage"].detail


@pytest.mark.slow
@pytest.mark.usefixtures("node")
def test_positions_that_leave_their_bounds_are_found_inside_the_compression(out):
    path = out / "bundle" / GLB
    data = path.read_bytes()
    at = data.index(b'"max":[') + len(b'"max":[')
    digit = b"1" if data[at : at + 1] != b"1" else b"2"
    path.write_bytes(data[:at] + digit + data[at + 1 :])
    found = lines(out)
    detail = found["glTF validator"].detail
    assert "decompressed: ACCESSOR_MAX_MISMATCH" in detail


@pytest.mark.slow
@pytest.mark.usefixtures("node")
def test_cut_texture_is_found(out):
    path = out / "bundle" / "volumes/r0_c0/CD31.ktx2"
    path.write_bytes(path.read_bytes()[:-100])
    found = lines(out)
    assert "CD31.ktx2" in found["KTX2 textures"].detail


def test_missing_node_is_named(made, monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    found = lines(made)["glTF validator"]
    assert not found.ok
    assert "install Node 20.19 or newer" in found.detail


def test_missing_packages_are_named(made, monkeypatch):
    answer = subprocess.CompletedProcess([], 1, "", "Error [ERR_MODULE_NOT_FOUND]: no package")
    monkeypatch.setattr(node_validators.subprocess, "run", lambda *args, **options: answer)
    found = lines(made)
    assert "run `make setup`" in found["glTF validator"].detail


@pytest.fixture
def cells(tmp_path):
    """A bundle of a label map."""
    object_bundle.write(tmp_path / "cells")
    return tmp_path / "cells"


@pytest.mark.slow
@pytest.mark.usefixtures("node")
def test_a_bundle_of_objects_passes(cells):
    assert [line for line in check(cells) if not line.ok] == []
    assert lines(cells)["object tables"].detail == f"{object_bundle.COUNT} objects"


def test_a_column_that_is_too_short_and_rows_beyond_the_table_are_named(cells):
    path = cells / "channels/cells/objects.json"
    content = json.loads(path.read_text("utf-8"))
    content["columns"][0]["bytes"]["bytes"] -= 1
    content["tiles"]["r0_c1"]["more"] = [object_bundle.COUNT]
    path.write_text(json.dumps(content))
    detail = lines(cells)["object tables"].detail
    assert "0_volume_um3.u8: found 60 bytes, expected 61" in detail
    assert "r0_c1: found row" in detail


def test_parts_of_a_column_with_other_hashes_than_stated_are_named(cells):
    path = cells / "channels/cells/objects.json"
    content = json.loads(path.read_text("utf-8"))
    column = content["columns"][2]
    column["parts"] = [column["exact"]["sha256"]]  # the few rows make a single part
    path.write_text(json.dumps(content))
    assert lines(cells)["object tables"].ok
    column["parts"] = ["0" * 64]
    path.write_text(json.dumps(content))
    assert "2_CD8.f32: found other SHA-256 of its parts" in lines(cells)["object tables"].detail


def test_a_column_that_is_damaged_is_named(cells):
    change_byte(cells / "channels/cells/objects/2_CD8.f32")
    assert "2_CD8.f32" in lines(cells)["hashes"].detail
