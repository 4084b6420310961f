"""A plain glTF is read by other programs, and agrees with the sphere that it shows."""

import json
import shutil
import struct
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from pxr import Gf, Usd, UsdGeom, Vt

from stereocell.export.options import ExportOptions, parse_region
from stereocell.export.write import export_stage
from stereocell.model.errors import UsageError
from support import spheres
from support.bundles import CD31

VIEWER = Path(__file__).parents[2] / "viewer_gltf"
FINE = spheres.LEVELS[0][0]


def document(path: Path) -> dict:
    data = path.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + length])


def test_another_library_finds_the_sphere_in_metres_with_colour_and_names(
    sphere_stage: Path, tmp_path: Path
) -> None:
    line = export_stage(sphere_stage, tmp_path / "s.glb", options=ExportOptions())
    scene = trimesh.load(tmp_path / "s.glb")
    assert set(scene.geometry) == {"CD31 r0_c0", "CD31 r0_c1"}
    low, high = scene.bounds
    center = spheres.CENTER * 1e-6
    np.testing.assert_allclose(low, center - spheres.RADIUS * 1e-6, atol=2e-8)
    np.testing.assert_allclose(high, center + spheres.RADIUS * 1e-6, atol=2e-8)
    red = scene.geometry["CD31 r0_c0"].visual.material.baseColorFactor
    assert red.tolist()[:3] == [255, 51, 26]
    found = document(tmp_path / "s.glb")
    assert "extensionsRequired" not in found
    assert "extensionsUsed" not in found
    assert [node["name"] for node in found["nodes"][:2]] == ["two tiles", "CD31"]
    triangles = sum(len(mesh.faces) for mesh in scene.geometry.values())
    assert line == (
        f"2 meshes, {triangles:,} triangles at lod0, in metres; life-size, 20 x 10 x 9 um; "
        "--scale 10000 enlarges it"
    )


def test_tiles_meet_without_a_gap(sphere_stage: Path, tmp_path: Path) -> None:
    export_stage(sphere_stage, tmp_path / "s.glb", options=ExportOptions())
    joined = trimesh.load(tmp_path / "s.glb", force="mesh")
    joined.merge_vertices(merge_norm=True, merge_tex=True)
    joined.update_faces(joined.nondegenerate_faces())
    assert joined.is_watertight


def level_of(stage: Path, path: Path, options: ExportOptions) -> str:
    """Export a stage; return the level of detail that the reported line names."""
    line = export_stage(stage, path, options=options)
    return line.partition(" at ")[2].partition(",")[0]


@pytest.mark.parametrize("name", ["s.glb", "s.gltf"])
def test_the_same_stage_gives_the_same_bytes_and_nothing_else_is_left(
    sphere_stage: Path, tmp_path: Path, name: str
) -> None:
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        export_stage(sphere_stage, tmp_path / folder / name, options=ExportOptions())
        assert [file.name for file in (tmp_path / folder).iterdir()] == [name]
    assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def test_gltf_has_an_edit_over_the_stage(edited: Callable[..., Path], tmp_path: Path) -> None:
    layer = edited(
        lambda s: s.GetAttributeAtPath(f"{CD31}.inputs:color").Set(Gf.Vec3f(0.25, 0.5, 0.75))
    )
    export_stage(layer, tmp_path / "s.glb", options=ExportOptions())
    (material,) = document(tmp_path / "s.glb")["materials"]
    assert material["pbrMetallicRoughness"]["baseColorFactor"] == [0.25, 0.5, 0.75, 1.0]


@pytest.mark.slow
def test_gltf_has_points_edited_by_hand_and_a_coarser_level_of_a_tile(
    edited: Callable[..., Path], tmp_path: Path
) -> None:
    def change(stage: Usd.Stage) -> None:
        tile = stage.GetPrimAtPath("/Specimen/Tiles/r0_c0")
        lod = tile.GetVariantSet("lod")
        lod.SetVariantSelection("lod0")
        with lod.GetVariantEditContext():
            mesh = UsdGeom.Mesh(stage.GetPrimAtPath(f"{tile.GetPath()}/CD31/CD31_r0_c0"))
            points = np.array(mesh.GetPointsAttr().Get())
            mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(points + np.float32([0, 2, 0])))
        other = stage.GetPrimAtPath("/Specimen/Tiles/r0_c1").GetVariantSet("lod")
        other.SetVariantSelection("lod2")

    layer = edited(change)
    for lod in (0, 1):  # coarser levels are made again from the edited level
        lines: list[str] = []
        export_stage(layer, tmp_path / "s.glb", options=ExportOptions(lod=lod), report=lines.append)
        assert any(line.startswith("r0_c0/CD31: edited by hand: lod0") for line in lines)
        assert lines[-1] == "2/2 r0_c1"
        meshes = trimesh.load(tmp_path / "s.glb").geometry
        high = meshes["CD31 r0_c0"].bounds[1] * 1e6
        assert high[1] == pytest.approx(spheres.CENTER[1] + spheres.RADIUS + 2, abs=0.05)
        assert len(meshes["CD31 r0_c1"].faces) < 2.2 * spheres.LEVELS[2][0] ** 2


@pytest.mark.slow
def test_finest_level_within_the_limits_is_written(sphere_stage: Path, tmp_path: Path) -> None:
    path = tmp_path / "s.glb"
    sizes = []
    for lod in (0, 1, 2):
        export_stage(sphere_stage, path, options=ExportOptions(lod=lod))
        sizes.append(path.stat().st_size)
    assert sizes == sorted(sizes, reverse=True)
    counts = [4 * rings * rings for rings, _ in spheres.LEVELS]
    for options in (
        ExportOptions(max_triangles=counts[1]), ExportOptions(max_bytes=sizes[1]),
    ):  # fmt: skip
        assert level_of(sphere_stage, path, options) == "lod1"
        assert path.stat().st_size == sizes[1]
    before = path.read_bytes()
    with pytest.raises(UsageError, match=f"--max-bytes is 100, expected at least {sizes[2]}"):
        export_stage(sphere_stage, path, options=ExportOptions(max_bytes=100))
    with pytest.raises(UsageError, match="--max-triangles is 3, expected at least"):
        export_stage(sphere_stage, path, options=ExportOptions(max_triangles=3))
    assert path.read_bytes() == before


def test_given_level_is_the_finest_that_may_be_written(sphere_stage: Path, tmp_path: Path) -> None:
    path = tmp_path / "s.glb"
    rings = [n for n, _ in spheres.LEVELS]
    few = ExportOptions(lod=0, max_triangles=4 * rings[1] ** 2)
    assert level_of(sphere_stage, path, few) == "lod1"
    small = ExportOptions(lod=0, max_bytes=path.stat().st_size)
    assert level_of(sphere_stage, path, small) == "lod1"
    coarse = ExportOptions(lod=2, max_triangles=4 * rings[0] ** 2)
    assert level_of(sphere_stage, path, coarse) == "lod2"
    with pytest.raises(UsageError, match="--max-triangles is 3, expected at least"):
        export_stage(sphere_stage, path, options=ExportOptions(lod=0, max_triangles=3))


@pytest.mark.slow
def test_triangles_outside_a_region_are_not_counted(sphere_stage: Path, tmp_path: Path) -> None:
    path, box = tmp_path / "s.glb", parse_region("9:,:-5,:")
    export_stage(sphere_stage, path, options=ExportOptions(region=box))
    meshes = trimesh.load(path).geometry.values()
    within = sum(len(mesh.faces) for mesh in meshes)
    assert within < 4 * spheres.LEVELS[1][0] ** 2  # triangles of the whole sphere at the next level
    options = ExportOptions(region=box, max_triangles=within)
    assert level_of(sphere_stage, path, options) == "lod0"
    options = ExportOptions(region=box, max_triangles=within - 1)
    assert level_of(sphere_stage, path, options) == "lod1"


def test_region_cuts_the_surface_and_tiles_select_parts(sphere_stage: Path, tmp_path: Path) -> None:
    box = ExportOptions(region=parse_region("9:,:-5,:"))
    export_stage(sphere_stage, tmp_path / "s.glb", options=box)
    low, high = trimesh.load(tmp_path / "s.glb").bounds * 1e6
    assert low[0] == pytest.approx(9, abs=1e-4)
    assert high[1] == pytest.approx(-5, abs=1e-4)
    assert high[0] == pytest.approx(spheres.CENTER[0] + spheres.RADIUS, abs=0.02)
    export_stage(sphere_stage, tmp_path / "s.glb", options=ExportOptions(tiles=("r0_c1",)))
    assert list(trimesh.load(tmp_path / "s.glb").geometry) == ["CD31 r0_c1"]


@pytest.mark.parametrize("packing", ["meshopt", "draco"])
def test_packed_files_have_the_same_surface_and_seam(
    sphere_stage: Path, tmp_path: Path, packing: str
) -> None:
    export_stage(sphere_stage, tmp_path / "s.glb", options=ExportOptions())
    path = tmp_path / "packed.glb"
    export_stage(sphere_stage, path, options=ExportOptions(compress=packing))
    assert path.stat().st_size < 0.35 * (tmp_path / "s.glb").stat().st_size
    found = document(path)
    places = []
    for node in found["nodes"][2:]:
        (primitive,) = found["meshes"][node["mesh"]]["primitives"]
        if packing == "draco":
            import DracoPy

            view = found["bufferViews"][
                primitive["extensions"]["KHR_draco_mesh_compression"]["bufferView"]
            ]
            data = path.read_bytes()
            start = len(data) - found["buffers"][0]["byteLength"] + view["byteOffset"]
            mesh = DracoPy.decode(data[start : start + view["byteLength"]])
            ids = primitive["extensions"]["KHR_draco_mesh_compression"]["attributes"]
            kinds = {one["unique_id"]: one["attribute_type"] for one in mesh.attributes}
            assert [kinds[ids[name]] for name in ("POSITION", "NORMAL")] == [0, 1]
            assert found["accessors"][primitive["indices"]]["count"] == mesh.faces.size
            places.append(mesh.points.astype(np.float32))
        else:
            places.append(meshopt_positions(path, found, node, primitive))
    cuts = [
        {tuple(p) for p in np.unique(part, axis=0) if abs(p[0] - 10e-6) < 1e-10} for part in places
    ]
    assert cuts[0] == cuts[1]
    assert len(cuts[0]) == 2 * FINE
    low = np.concatenate(places).min(axis=0)
    np.testing.assert_allclose(low, (spheres.CENTER - spheres.RADIUS) * 1e-6, atol=3e-8)


def meshopt_positions(path: Path, found: dict, node: dict, primitive: dict) -> np.ndarray:
    import meshopt

    data = path.read_bytes()
    accessor = found["accessors"][primitive["attributes"]["POSITION"]]
    packed = found["bufferViews"][accessor["bufferView"]]["extensions"]["EXT_meshopt_compression"]
    start = len(data) - -(-found["buffers"][0]["byteLength"] // 4) * 4 + packed.get("byteOffset", 0)
    stream = data[start : start + packed["byteLength"]]
    rows = meshopt.decode_vertex_buffer(stream, packed["count"], packed["byteStride"])
    steps = rows.view("<u2")[:, :3]
    scaled = steps.astype(np.float32) * np.float32(node["scale"][0])
    return scaled + np.array(node["translation"], np.float32)


NODE = """
import fs from 'node:fs'
import validator from 'gltf-validator'
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js'
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js'
import { Box3 } from 'three'

globalThis.ProgressEvent = class {}  // three's own, of the browser
const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder)
const found = {}
for (const file of process.argv.slice(1)) {
  const bytes = new Uint8Array(fs.readFileSync(file))
  const { issues } = await validator.validateBytes(bytes)
  const opened = file.includes('draco') ? null : await loader.parseAsync(bytes.buffer, '')
  const box = opened && new Box3().setFromObject(opened.scene)
  found[file] = { issues, box: box && [box.min.toArray(), box.max.toArray()] }
}
console.log(JSON.stringify(found))
"""


@pytest.mark.slow
def test_khronos_validator_finds_no_error_and_three_opens_it(
    sphere_stage: Path, tmp_path: Path
) -> None:
    node = shutil.which("node")
    if node is None or not (VIEWER / "node_modules" / "gltf-validator").is_dir():
        pytest.skip("gltf-validator is missing: run make setup")
    for name, options in (
        ("a.glb", ExportOptions(occlusion=True)), ("a.gltf", ExportOptions()),
        ("meshopt.glb", ExportOptions(compress="meshopt")),
        ("draco.glb", ExportOptions(compress="draco")),
    ):  # fmt: skip
        export_stage(sphere_stage, tmp_path / name, options=options)
    files = sorted(map(str, tmp_path.iterdir()))
    command = [node, "--input-type=module", "-e", NODE, *files]
    printed = subprocess.run(command, cwd=VIEWER, capture_output=True, text=True, check=True)
    for file, found in json.loads(printed.stdout).items():
        issues = found["issues"]
        assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"][:3]
        if "draco" not in file:  # three decodes draco only in a browser's worker
            ends = (spheres.CENTER - spheres.RADIUS, spheres.CENTER + spheres.RADIUS)
            np.testing.assert_allclose(found["box"], np.array(ends) * 1e-6, atol=3e-8)
