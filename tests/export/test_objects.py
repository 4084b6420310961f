"""Exported objects of a label map have names and colours, and are whole where tiles cut them."""

import json
import struct
from pathlib import Path

import numpy as np
import pymeshlab
import pytest
import pyvista
import trimesh

from stereocell.export import gltf_scene, print_solids
from stereocell.export.options import ExportOptions
from stereocell.export.write import export_stage
from stereocell.model.color import to_srgb8
from stereocell.model.errors import StageError
from support import object_stage
from support.object_stage import BEAM, COLORS, LABELS, write_objects

NAMES = ("left", "cells 12", "beam")
BALL_UM3 = 4 / 3 * np.pi * object_stage.RADIUS_UM**3
BEAM_UM3 = float(np.prod(np.subtract(*BEAM[::-1])))


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_objects(tmp_path_factory.mktemp("objects"))


def document(path: Path) -> dict:
    data = path.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + length])


def test_gltf_has_a_node_for_each_object_with_label_name_and_colour(
    stage: Path, tmp_path: Path
) -> None:
    export_stage(stage, tmp_path / "o.glb", options=ExportOptions())
    scene = trimesh.load(tmp_path / "o.glb")
    nodes = document(tmp_path / "o.glb")["nodes"]
    labels = {node["extras"]["label"]: node["name"] for node in nodes if "mesh" in node}
    assert labels == dict(zip(LABELS, NAMES, strict=True))
    assert len(scene.geometry) == 4  # the beam has a mesh in each tile
    colors = {
        tuple(mesh.visual.material.baseColorFactor[:3].tolist()) for mesh in scene.geometry.values()
    }
    wanted = {tuple(np.rint(255 * np.array(color)).astype(int).tolist()) for color in COLORS}
    assert colors == wanted


def test_tile_of_very_many_objects_is_one_mesh_in_their_colours(
    stage: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gltf_scene, "MAX_NODES", 1)
    export_stage(stage, tmp_path / "o.glb", options=ExportOptions())
    scene = trimesh.load(tmp_path / "o.glb")
    assert set(scene.geometry) == {"cells r0_c0", "cells r0_c1"}
    seen = {
        tuple(color[:3].tolist())
        for mesh in scene.geometry.values()
        for color in mesh.visual.vertex_attributes["color"]
    }
    assert seen == {tuple(np.rint(255 * np.array(color)).astype(int).tolist()) for color in COLORS}


def test_3mf_has_closed_and_whole_objects(stage: Path, tmp_path: Path) -> None:
    options = ExportOptions(scale=1000, wall_mm=2.5, components=True)
    line = export_stage(stage, tmp_path / "o.3mf", options=options)
    bodies = trimesh.load(tmp_path / "o.3mf").geometry
    assert set(bodies) == set(NAMES)
    assert all(body.is_watertight for body in bodies.values())
    assert bodies["beam"].volume == pytest.approx(BEAM_UM3, rel=1e-6)
    assert bodies["left"].volume == pytest.approx(BALL_UM3, rel=0.03)
    assert "beam: 1 of 1 bodies are thinner than 2.5 mm" in line  # the beam is 2 mm high
    assert "left" not in line.partition("\n")[2]


def test_some_of_many_thin_parts_are_named_and_all_are_counted(
    stage: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(print_solids, "_MAX_REPORTED", 1)
    lines = export_stage(
        stage, tmp_path / "o.3mf", options=ExportOptions(scale=1, wall_mm=5)
    ).split("\n")
    assert len(lines) == 3
    assert lines[2] == f"... and {len(NAMES) - 1} more parts with thin bodies"


def test_export_of_a_label_maps_volume_is_refused(stage: Path, tmp_path: Path) -> None:
    with pytest.raises(StageError, match="no volume of cells \\(label maps have only surf"):
        export_stage(stage, tmp_path / "o.nrrd", options=ExportOptions(channels=("cells",)))


def test_ply_has_the_colours_of_objects_and_stl_is_one_solid(stage: Path, tmp_path: Path) -> None:
    export_stage(stage, tmp_path / "o.ply", options=ExportOptions(scale=1000))
    wanted = {tuple(to_srgb8(np.array(color, np.float32)).tolist()) for color in COLORS}
    assert {
        tuple(color[:3].tolist()) for color in pyvista.read(tmp_path / "o.ply")["RGBA"]
    } == wanted
    export_stage(stage, tmp_path / "o.stl", options=ExportOptions(scale=1000))
    solid = trimesh.load(tmp_path / "o.stl")
    assert solid.is_watertight
    assert len(solid.split()) == 3
    assert solid.volume == pytest.approx(2 * BALL_UM3 + BEAM_UM3, rel=0.03)


def test_obj_has_names_and_colours_of_objects(stage: Path, tmp_path: Path) -> None:
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        export_stage(stage, tmp_path / folder / "o.obj", options=ExportOptions(scale=1000))
    for name in ("o.obj", "o.mtl"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    lines = (tmp_path / "one" / "o.obj").read_text("utf-8").splitlines()
    named = [line[2:] for line in lines if line.startswith("o ")]
    assert named == ["left", "cells_x20_12", "beam"]
    assert lines[0].endswith(", unit mm")
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(tmp_path / "one" / "o.obj"))
    colors = np.rint(255 * meshes.current_mesh().face_color_matrix()[:, :3]).astype(int)
    wanted = {tuple(to_srgb8(np.array(color, np.float32)).tolist()) for color in COLORS}
    assert set(map(tuple, colors.tolist())) == wanted


@pytest.mark.parametrize(("scale", "units"), [(1.0, "m"), (1e6, "um")])
def test_coordinates_of_an_obj_have_the_precision_of_a_float(
    stage: Path, tmp_path: Path, scale: float, units: str
) -> None:
    options = ExportOptions(scale=scale, units=units)
    export_stage(stage, tmp_path / "o.obj", options=options)
    export_stage(stage, tmp_path / "o.ply", options=options)
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(tmp_path / "o.obj"))
    exact = pyvista.read(tmp_path / "o.ply").points
    found = meshes.current_mesh().vertex_matrix()
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-7 * np.abs(exact).max())


def test_neuroglancer_lists_objects_by_label(stage: Path, tmp_path: Path) -> None:
    export_stage(stage, tmp_path / "o.precomputed", options=ExportOptions())
    info = json.loads((tmp_path / "o.precomputed/cells/segment_properties/info").read_text("utf-8"))
    named = dict(zip(info["inline"]["ids"], info["inline"]["properties"][0]["values"], strict=True))
    assert named == {str(label): name for label, name in zip(LABELS, NAMES, strict=True)}
    assert not (tmp_path / "o.precomputed/image").exists()
    assert all((tmp_path / f"o.precomputed/cells/{label}.index").is_file() for label in LABELS)


def test_picture_and_usd_files_of_objects_are_written(stage: Path, tmp_path: Path) -> None:
    for name in ("o.png", "o.usdz", "o.usdc"):
        options = ExportOptions(width=300) if name == "o.png" else ExportOptions()
        export_stage(stage, tmp_path / name, options=options)
        assert (tmp_path / name).stat().st_size > 1000
