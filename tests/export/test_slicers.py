"""Slicers slice the parts of a .3mf at the places that the parts have in the stage."""

import re
import shutil
import subprocess
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import lib3mf
import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from stereocell.export.options import ExportOptions
from stereocell.export.write import export_stage
from stereocell.model.color import to_srgb8
from support.solid_channels import BALLS, COLORS, write_solid_channels

LAYER_MM = 0.2
LINE_MM = 0.6  # mm, largest width of a line; extrusions lie half of it inside the surface
BY_SIZE = ["tissue", "vessel", "nucleus"]


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_solid_channels(tmp_path_factory.mktemp("solids"))


def slice_by_prusa(model: Path, folder: Path) -> dict[int, NDArray[np.float64]]:
    """Return the ends of extrusions (x, y, z), mm, by the number of the extruder, from 0."""
    program = shutil.which("prusa-slicer")
    if program is None:
        pytest.skip("prusa-slicer is not installed: apt-get install prusa-slicer")
    code = folder / "sliced.gcode"
    command = [
        program, "--export-gcode", str(model), "--output", str(code), "--dont-arrange",
        "--nozzle-diameter", "0.4,0.4,0.4", "--layer-height", str(LAYER_MM),
        "--first-layer-height", str(LAYER_MM), "--skirts", "0", "--use-relative-e-distances",
        "--datadir", str(folder / "settings"),
    ]  # fmt: skip
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    tool, place = 0, np.zeros(3)
    found: dict[int, list[NDArray[np.float64]]] = {}
    for line in code.read_text("utf-8").splitlines():
        if change := re.match(r"T(\d+)\b", line):
            tool = int(change[1])
        if not line.startswith("G1 "):
            continue
        words = {word[0]: word[1:] for word in line.partition(";")[0].split()[1:]}
        before, place = place, place.copy()
        for axis, letter in enumerate("XYZ"):
            if letter in words:
                place[axis] = float(words[letter])
        if float(words.get("E", 0)) > 0 and ("X" in words or "Y" in words):
            found.setdefault(tool, []).extend([before, place])
    return {one: np.array(places) for one, places in found.items()}


@pytest.mark.slow
def test_prusaslicer_prints_each_channel_where_the_stage_has_it(
    stage: Path, tmp_path: Path
) -> None:
    export_stage(stage, tmp_path / "s.3mf", options=ExportOptions(scale=1000))
    sliced = slice_by_prusa(tmp_path / "s.3mf", tmp_path)
    assert sorted(sliced) == [0, 1, 2]  # one filament for each channel
    shifts = []
    for tool, name in enumerate(BALLS):  # filaments are in the order of the channels
        center, radius = np.array(BALLS[name][0]), BALLS[name][1]
        low, high = sliced[tool].min(axis=0), sliced[tool].max(axis=0)
        np.testing.assert_allclose((high - low)[:2], 2 * radius, atol=LINE_MM + 0.1)
        assert high[2] - low[2] == pytest.approx(2 * radius, abs=2 * LAYER_MM)
        shifts.append((low + high) / 2 - center)
    # The slicer moved the whole specimen to the bed, all parts by the same vector.
    np.testing.assert_allclose(shifts, np.broadcast_to(shifts[0], (3, 3)), atol=LAYER_MM)
    tissue_bottom = BALLS["tissue"][0][2] - BALLS["tissue"][1]
    assert shifts[0][2] == pytest.approx(-tissue_bottom, abs=LAYER_MM)


@pytest.mark.slow
def test_prusaslicer_moves_components_apart(stage: Path, tmp_path: Path) -> None:
    """Parts are ranges by default, because PrusaSlicer would put the vessel on the bed."""
    export_stage(stage, tmp_path / "s.3mf", options=ExportOptions(scale=1000, components=True))
    sliced = slice_by_prusa(tmp_path / "s.3mf", tmp_path)
    lowest = np.concatenate(list(sliced.values()))[:, 2].min()
    highest = np.concatenate(list(sliced.values()))[:, 2].max()
    # In the stage, the vessel lies above the tissue.
    assert highest - lowest < 2 * BALLS["tissue"][1] + LAYER_MM


def test_ranges_are_closed_parts_with_name_and_filament(stage: Path, tmp_path: Path) -> None:
    export_stage(stage, tmp_path / "s.3mf", options=ExportOptions(scale=1000))
    with zipfile.ZipFile(tmp_path / "s.3mf") as archive:
        settings = ElementTree.fromstring(archive.read("Metadata/Slic3r_PE_model.config"))
        model = archive.read("3D/3dmodel.model").decode()
    # Bambu Studio and OrcaSlicer look for this word, and then read the list of ranges, too.
    assert re.search('<metadata name="Application">stereocell [^<]*PrusaSlicer', model)
    [whole] = trimesh.load(tmp_path / "s.3mf").geometry.values()
    first, names = 0, []
    for volume in settings.findall("object/volume"):
        values = {one.get("key"): one.get("value") for one in volume.findall("metadata")}
        names.append(values["name"])
        assert values["extruder"] == str(1 + list(BALLS).index(values["name"]))
        assert values["volume_type"] == "ModelPart"
        assert int(volume.get("firstid")) == first
        faces = whole.faces[first : int(volume.get("lastid")) + 1]
        part = trimesh.Trimesh(whole.vertices, faces, process=True)
        center, radius = BALLS[values["name"]]
        assert part.is_watertight
        np.testing.assert_allclose(part.centroid, center, atol=1e-3)
        assert part.volume == pytest.approx(4 / 3 * np.pi * radius**3, rel=0.02)
        # PrusaSlicer takes all vertices from the lowest to the highest index of a part.
        assert len(np.unique(faces)) == np.ptp(faces) + 1
        first += len(faces)
    assert first == len(whole.faces)
    assert names == BY_SIZE  # the nucleus after the tissue, which would be printed over it


@pytest.mark.parametrize("components", [None, True])
def test_parts_are_one_object_in_their_colours_by_3mf_s_own_library(
    stage: Path, tmp_path: Path, components: bool | None
) -> None:
    path = tmp_path / "s.3mf"
    export_stage(stage, path, options=ExportOptions(scale=1000, components=components))
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(path))
    assert reader.GetWarningCount() == 0
    items = model.GetBuildItems()
    assert items.MoveNext()
    assert items.GetCurrent().GetObjectResource().GetName() == "three <solids>"
    assert not items.MoveNext()
    meshes = model.GetMeshObjects()
    seen = []
    while meshes.MoveNext():
        mesh = meshes.GetCurrentMeshObject()
        assert mesh.IsManifoldAndOriented()
        for triangle in mesh.GetAllTriangleProperties():
            group = model.GetBaseMaterialGroupByID(triangle.ResourceID)
            color = group.GetDisplayColor(triangle.PropertyIDs[0])
            name = group.GetName(triangle.PropertyIDs[0])
            seen.append((name, (color.Red, color.Green, color.Blue)))
    assert len(seen) == sum(len(part.faces) for part in trimesh.load(path).geometry.values())
    wanted = {
        name: tuple(to_srgb8(np.array(color, np.float32)).tolist())
        for name, color in COLORS.items()
    }
    assert dict(seen) == wanted
    assert len(set(seen)) == len(wanted)


def test_components_are_named_objects_and_bambu_s_parts(stage: Path, tmp_path: Path) -> None:
    export_stage(stage, tmp_path / "s.3mf", options=ExportOptions(scale=1000, components=True))
    scene = trimesh.load(tmp_path / "s.3mf")
    assert set(scene.geometry) == set(BALLS)
    with zipfile.ZipFile(tmp_path / "s.3mf") as archive:
        settings = ElementTree.fromstring(archive.read("Metadata/model_settings.config"))
        model = ElementTree.fromstring(archive.read("3D/3dmodel.model"))
        assert b"PrusaSlicer" not in archive.read("3D/3dmodel.model")
    core = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
    objects = {one.get("id"): one for one in model.iter(f"{core}object")}
    [item] = model.iter(f"{core}item")
    [described] = settings.findall("object")
    assert described.get("id") == item.get("objectid")
    joined = [one.get("objectid") for one in objects[item.get("objectid")].iter(f"{core}component")]
    parts = described.findall("part")
    assert [part.get("id") for part in parts] == joined
    for part in parts:
        assert part.get("subtype") == "normal_part"
        values = {one.get("key"): one.get("value") for one in part.findall("metadata")}
        assert values["name"] == objects[part.get("id")].get("name")
        assert values["extruder"] == str(1 + list(BALLS).index(values["name"]))
