"""Objects in a .glb: the object of each vertex, a table of objects, and the validator's result."""

import json
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from stereocell.formats.gltf import Material, choose_step, encode_glb
from stereocell.formats.gltf_features import MAX_COLUMNS, Features
from stereocell.model.object_table import Column
from stereocell.storage.assets import find_asset
from support import object_bundle
from support.glbs import property_table, read
from support.object_bundle import tile_features

TABLE = object_bundle.make_table()
TILE = object_bundle.TILES[1]
ROWS = TABLE.rows[TILE]
MESH = object_bundle.tile_mesh(1, 8)


def encode(mesh=MESH, features=None):
    return encode_glb(
        mesh,
        choose_step(60),
        material=Material((1, 1, 1)),
        name="cells",
        extras={"tile": TILE, "channel": "cells"},
        features=features,
    ).data


def arrays_of(data):
    document, arrays = read(data)
    (primitive,) = document["meshes"][0]["primitives"]
    names = {**primitive["attributes"], "indices": primitive["indices"]}
    return {name: arrays[i] for name, i in names.items()}


def shuffled(mesh, seed=1):
    """Return the mesh with its vertices and triangles in random order."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(mesh.positions))
    new = np.argsort(order).astype(np.uint32)
    triangles = new[mesh.triangles][rng.permutation(len(mesh.triangles))]
    return replace(
        mesh,
        positions=mesh.positions[order],
        normals=mesh.normals[order],
        objects=mesh.objects[order],
        triangles=triangles,
    )


def test_every_vertex_has_its_object():
    arrays = arrays_of(encode(shuffled(MESH)))
    ids = arrays["_FEATURE_ID_0"][:, 0]
    assert sorted(set(ids.tolist())) == list(range(len(ROWS)))
    step_um = choose_step(60) * 1e6
    origin = np.rint(MESH.positions / step_um).min(axis=0)
    places = (arrays["POSITION"] + origin) * step_um
    for i, row in enumerate(ROWS[:-1]):
        off = np.linalg.norm(places[ids == i] - object_bundle.center(row), axis=1)
        assert np.abs(off - object_bundle.RADIUS_UM).max() < 2 * step_um


def test_triangles_are_grouped_by_object():
    arrays = arrays_of(encode(shuffled(MESH)))
    ids = arrays["_FEATURE_ID_0"][:, 0].astype(int)
    owners = ids[arrays["indices"].reshape(-1, 3)]
    assert (owners == owners[:, :1]).all()
    assert (np.diff(ids) >= 0).all()
    assert (np.diff(owners[:, 0]) >= 0).all()
    assert len(owners) == len(MESH.triangles)


def test_the_table_has_labels_and_columns():
    features = tile_features(TABLE, TILE, wanted=("CD8", "cell_type", "no such"))
    found = property_table(encode(features=features))
    assert found["label"] == TABLE.labels[ROWS].tolist()
    assert list(found) == ["label", "volume_um3", "CD8", "cell_type"]
    for name in ("volume_um3", "CD8"):
        values = TABLE.column(name).values[ROWS]
        assert found[name] == [None if np.isnan(v) else float(v) for v in values]
    kinds = TABLE.column("cell_type").values[ROWS].astype(int)
    names = TABLE.column("cell_type").categories
    assert found["cell_type"] == [None if k < 0 else names[k] for k in kinds]


def test_missing_values_are_read_back_as_no_data():
    first = tile_features(TABLE, object_bundle.TILES[0], wanted=("CD8", "cell_type"))
    found = property_table(encode(object_bundle.tile_mesh(0, 8), first))
    assert [i for i, v in enumerate(found["CD8"]) if v is None] == [3]
    assert [i for i, v in enumerate(found["cell_type"]) if v is None] == [4]


def test_a_category_may_be_called_none_and_two_may_be_called_alike():
    values = (np.arange(len(ROWS)) % 4 - 1).astype(np.float32)
    column = Column("kind", "Kind", values, categories=("none", "T", "T"))
    found = property_table(encode(features=Features(TABLE.labels[ROWS], (column,))))["kind"]
    assert found[:5] == [None, "none", "T", "T_", None]


def test_labels_of_64_bits_are_exact():
    wide = object_bundle.make_table(is_wide=True)
    found = property_table(encode(features=tile_features(wide, TILE)))
    assert found["label"][-1] == 2**63


def test_meshes_without_objects_use_no_extension_for_them():
    document, _ = read(encode(replace(MESH, objects=None)))
    assert "EXT_mesh_features" not in document["extensionsUsed"]
    assert "_FEATURE_ID_0" not in document["meshes"][0]["primitives"][0]["attributes"]


def test_readers_without_support_for_objects_can_draw_them():
    document, _ = read(encode(features=tile_features(TABLE, TILE)))
    assert set(document["extensionsUsed"]) >= {"EXT_mesh_features", "EXT_structural_metadata"}
    required = {"EXT_meshopt_compression", "KHR_mesh_quantization"}
    assert set(document["extensionsRequired"]) == required
    ids = document["meshes"][0]["primitives"][0]["extensions"]["EXT_mesh_features"]
    assert ids == {"featureIds": [{"featureCount": len(ROWS), "attribute": 0, "propertyTable": 0}]}


def test_objects_that_cannot_be_numbered_are_refused():
    far = MESH.objects.copy()
    far[-24:] = 1 << 16
    with pytest.raises(ValueError, match="split the tile"):
        encode(replace(MESH, objects=far))
    mixed = MESH.objects.copy()
    mixed[MESH.triangles[0, 0]] = 5
    with pytest.raises(ValueError, match="between two objects"):
        encode(replace(MESH, objects=mixed))
    with pytest.raises(ValueError, match="one row for each"):
        encode(features=Features(TABLE.labels[:3], ()))
    one = Column("a", "a", np.zeros(4, np.float32))
    with pytest.raises(ValueError, match="expected up to 8"):
        encode(features=Features(TABLE.labels[:40], (one,) * (MAX_COLUMNS + 1)))


def test_the_last_object_of_16_bits_is_written():
    objects = MESH.objects.copy()
    objects[-24:] = (1 << 16) - 1
    assert arrays_of(encode(replace(MESH, objects=objects)))["_FEATURE_ID_0"].max() == 65535


def test_the_same_objects_give_the_same_bytes():
    assert encode(features=tile_features(TABLE, TILE)) == encode(
        features=tile_features(TABLE, TILE)
    )


@pytest.mark.slow
def test_the_bundle_of_the_tests_is_valid(tmp_path):
    object_bundle.write(tmp_path)
    paths = [str(path) for path in sorted(tmp_path.rglob("*.glb"))]
    assert len(paths) == 4
    answer = subprocess.run(
        [shutil.which("node"), str(find_asset("viewer_gltf/tools/check_glb.mjs"))],
        input=json.dumps(paths),
        capture_output=True,
        text=True,
        check=True,
    )
    assert [result["problems"] for result in json.loads(answer.stdout)] == [[]] * 4
