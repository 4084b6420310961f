"""Bundles whose finer surfaces are in external tilesets, and the errors for faulty ones."""

import json
import shutil

import pytest

from stereocell.engine.run import Engine
from stereocell.formats import tiles3d
from stereocell.formats.tiles3d import content_hash
from stereocell.formats.tiles3d_walk import walk
from stereocell.verify.bundle_against_stage import BundleTask, compare_part
from stereocell.verify.formats import check
from support import spheres
from support.bundles import write_bundle

CHANNEL = "channels/CD31"
FINER = f"{CHANNEL}/r0_c0/finer.json"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Build a tile of three LODs in a bundle for which one tile counts as many."""
    out = tmp_path_factory.mktemp("out")
    spheres.write_one_tile(out / "stage")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tiles3d, "MAX_WHOLE_TILES", 0)
        write_bundle(out / "stage" / "stage.usda", out / "bundle", None, engine=Engine(0))
    return out


@pytest.fixture
def bundle(made, tmp_path):
    """Return a copy of the bundle that a test may damage."""
    return shutil.copytree(made / "bundle", tmp_path / "bundle")


def found(bundle, name="tilesets"):
    """Return the line of that name. Later lines, which take long, are not computed."""
    return next(line for line in check(bundle.parent) if line.name == name)


def test_bundles_of_the_pipeline_pass(bundle):
    assert (found(bundle).ok, found(bundle).detail) == (True, "3 contents")
    assert found(bundle, "hashes").ok


def test_external_tilesets_are_listed(bundle):
    listed = json.loads((bundle / "files.json").read_bytes())
    assert {path for path in listed if path.endswith(".json")} >= {FINER, f"{CHANNEL}/tileset.json"}


def test_contents_are_yielded_coarse_ones_first_with_their_paths(bundle):
    names = [
        (content.path.relative_to(bundle / CHANNEL).as_posix(), content.error_m <= content.limit_m)
        for content in walk(bundle, bundle / CHANNEL / "tileset.json")
    ]
    files = ["lod2.glb", "finer.json", "lod1.glb", "lod0.glb"]
    assert names == [(f"r0_c0/{name}", True) for name in files]


def test_other_tiles_are_not_opened(bundle):
    (bundle / FINER).unlink()
    assert list(walk(bundle, bundle / CHANNEL / "tileset.json", "r0_c1")) == []


def test_surfaces_in_an_external_tileset_are_compared_with_the_stage(made):
    task = BundleTask(made / "stage" / "stage.usda", made / "bundle", "r0_c0", "CD31")
    finding = compare_part(task)
    assert (finding.surfaces, finding.problems) == (3, ())


def test_a_changed_surface_in_an_external_tileset_is_found(bundle):
    path = bundle / CHANNEL / "r0_c0/lod0.glb"
    path.write_bytes(path.read_bytes()[:-1] + b"?")
    assert f"{FINER}: lod0.glb: found sha-256-128 " in found(bundle).detail


def test_a_damaged_external_tileset_is_found(bundle):
    path = bundle / FINER
    path.write_bytes(path.read_bytes().replace(b"lod1.glb", b"lod9.glb"))
    detail = found(bundle).detail
    assert f"{CHANNEL}/tileset.json: r0_c0/finer.json: found sha-256-128 " in detail
    assert f"{FINER}: found no file at lod9.glb" in detail


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b'{"asset": {', "damaged, this is not JSON"),
        (b"[]", "not a 3D Tiles tileset"),
        (b'{"geometricError": 1}', "not a 3D Tiles tileset"),
    ],
)
def test_a_file_that_is_not_a_tileset_is_found(bundle, content, message):
    (bundle / FINER).write_bytes(content)
    detail = found(bundle).detail
    assert f"{FINER}: {message}" in detail
    assert "\n" not in detail


def test_a_missing_external_tileset_is_found_once(bundle):
    (bundle / FINER).unlink()
    assert found(bundle).detail.count("finer.json") == 1
    assert f"{FINER} is missing: run `stereocell bundle OUT`" in found(bundle).detail


@pytest.mark.parametrize("uri", ["finer.json", "../tileset.json"])
def test_tilesets_that_name_themselves_are_refused(bundle, uri):
    path = bundle / FINER
    path.write_text(path.read_text("utf-8").replace("lod1.glb", uri))
    assert f"{FINER}: {uri} is a tileset that was named before" in found(bundle).detail


@pytest.mark.parametrize("uri", ["../../../../secret.json", "/etc/passwd"])
def test_files_outside_the_bundle_are_not_opened(bundle, uri):
    (bundle.parent / "secret.json").write_text("no JSON")
    path = bundle / FINER
    path.write_text(path.read_text("utf-8").replace("lod1.glb", uri))
    detail = found(bundle).detail
    assert f"{FINER}: {uri} is outside the bundle" in detail
    assert "no JSON" not in detail


def test_a_tileset_that_is_a_link_to_itself_is_found(bundle):
    (bundle / FINER).unlink()
    (bundle / FINER).symlink_to(bundle / FINER)
    assert FINER in found(bundle).detail
    assert "\n" not in found(bundle).detail


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ('"lod1.glb"', f'"{"a" * 5000}.glb"', "expected up to 1024 characters"),
        ('"geometricError":', '"geometricError":"x","was":', "not a 3D Tiles tileset: ValueError"),
    ],
)
def test_the_error_for_invalid_content_is_one_line(bundle, before, after, message):
    path = bundle / FINER
    path.write_text(path.read_text("utf-8").replace(before, after))
    detail = found(bundle).detail
    assert message in detail
    assert "\n" not in detail
    assert len(detail) < 1000


def test_errors_that_grow_within_an_external_tileset_are_found(bundle):
    path = bundle / FINER
    content = json.loads(path.read_bytes())
    content["root"]["geometricError"] = 9.0
    path.write_text(json.dumps(content))
    assert f"{FINER}: lod1.glb: geometricError is 9, expected at most" in found(bundle).detail


def test_the_hash_of_an_external_tileset_is_that_of_its_bytes(bundle):
    listed = json.loads((bundle / "files.json").read_bytes())
    contents = walk(bundle, bundle / CHANNEL / "tileset.json")
    (external,) = (content for content in contents if content.is_tileset)
    assert external.named["extras"] == {"sha-256-128": content_hash(listed[FINER]["sha256"])}
