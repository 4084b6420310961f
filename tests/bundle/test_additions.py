"""Meshes and curves that a layer adds reach the bundle with their place, name and material."""

import numpy as np
import pytest
import trimesh
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade

from stereocell.model.errors import StageError
from support.bundles import load
from support.edit_cases import BRANCH, define_arrow, define_material, define_wire


def scene_of(bundle):
    """Return the meshes of additions.glb, read by another library, in um, by names of nodes."""
    scene = trimesh.load(bundle / "additions.glb")
    return {
        name: scene.geometry[geometry].copy().apply_transform(matrix).apply_scale(1e6)
        for name in scene.graph.nodes_geometry
        for matrix, geometry in [scene.graph[name]]
    }


def test_an_added_mesh_is_a_layer_with_its_place_name_and_color(edit):
    def change(stage):
        group = UsdGeom.Xform.Define(stage, "/Specimen/Annotations")
        UsdGeom.XformCommonAPI(group).SetTranslate((0, 2, 0))
        define_arrow(stage).GetPrim().SetDisplayName("Here")

    bundle = edit(change)
    assert edit.lines == []
    added = load(bundle / "manifest.json")["additions"]
    assert added["layers"] == [{"id": "/Specimen/Annotations/Arrow", "name": "Here"}]
    assert load(bundle / "files.json")["additions.glb"]["sha256"] == added["file"]["sha256"]
    (mesh,) = scene_of(bundle).values()
    assert mesh.bounds == pytest.approx(np.array([(8, 2, 4), (12, 11, 4)]), abs=1e-4)
    assert len(mesh.faces) == 3
    assert added["bounds_um"] == {"min": [8, 2, 4], "max": [12, 11, 4]}
    color = mesh.visual.material.baseColorFactor
    assert tuple(color) == (0, 0, 255, 255)


def test_an_added_mesh_has_the_material_that_is_bound_to_it(edit):
    def change(stage):
        arrow = define_arrow(stage)
        material = define_material(stage, "/Specimen/Annotations/Gold", (1.0, 0.5, 0.0))
        shader = UsdShade.Shader(stage.GetPrimAtPath("/Specimen/Annotations/Gold/preview"))
        shader.CreateInput("opacity", Sdf.ValueTypeNames.Float).Set(0.5)
        UsdShade.MaterialBindingAPI.Apply(arrow.GetPrim()).Bind(material)

    bundle = edit(change)
    assert edit.lines == []
    (mesh,) = scene_of(bundle).values()
    assert mesh.visual.material.alphaMode == "BLEND"
    assert tuple(mesh.visual.material.baseColorFactor) == (255, 128, 0, 128)


def test_curves_are_tubes_as_thick_as_stated(edit):
    (mesh,) = scene_of(edit(define_wire)).values()
    assert mesh.is_watertight or trimesh.Trimesh(mesh.vertices, mesh.faces).is_watertight
    assert mesh.bounds == pytest.approx(np.array([(2, -5.5, 3.5), (18, -4.5, 4.5)]), abs=1e-4)


@pytest.mark.parametrize("basis", ["bezier", "bspline", "catmullRom"])
def test_cubic_curves_pass_where_usd_s_basis_puts_them(edit, basis):
    vertices = [(0, 0, 0), (2, 4, 0), (6, 4, 0), (8, 0, 0)]

    def change(stage):
        curves = UsdGeom.BasisCurves.Define(stage, "/Specimen/Wire")
        curves.CreateTypeAttr("cubic")
        curves.CreateBasisAttr(basis)
        curves.CreateCurveVertexCountsAttr([4])
        curves.CreatePointsAttr([Gf.Vec3f(*vertex) for vertex in vertices])
        curves.CreateWidthsAttr([0.1])

    (mesh,) = scene_of(edit(change)).values()
    weights = {
        "bezier": (1 / 8, 3 / 8, 3 / 8, 1 / 8),
        "bspline": (1 / 48, 23 / 48, 23 / 48, 1 / 48),
        "catmullRom": (-1 / 16, 9 / 16, 9 / 16, -1 / 16),
    }[basis]
    middle = np.array(weights) @ np.array(vertices)
    away = np.linalg.norm(mesh.vertices - middle, axis=1)
    assert away.min() == pytest.approx(0.05, abs=2e-4)


def test_hidden_additions_and_guides_are_left_out(edit):
    def change(stage):
        UsdGeom.Imageable(define_arrow(stage)).MakeInvisible()
        define_wire(stage).CreatePurposeAttr("guide")

    bundle = edit(change)
    assert not (bundle / "additions.glb").exists()
    assert "additions" not in load(bundle / "manifest.json")


def test_an_image_on_an_added_mesh_is_named(edit, tmp_path):
    (tmp_path / "wood.png").write_bytes(b"")

    def change(stage):
        arrow = define_arrow(stage)
        material = define_material(stage, "/Specimen/Wood", (1, 1, 1))
        texture = UsdShade.Shader.Define(stage, "/Specimen/Wood/image")
        texture.CreateIdAttr("UsdUVTexture")
        texture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set("./wood.png")
        output = texture.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)
        shader = UsdShade.Shader(stage.GetPrimAtPath("/Specimen/Wood/preview"))
        shader.GetInput("diffuseColor").ConnectToSource(output)
        UsdShade.MaterialBindingAPI.Apply(arrow.GetPrim()).Bind(material)

    edit(change)
    lost = "image wood.png of /Specimen/Annotations/Arrow is not taken over"
    assert f"{lost}: the viewer draws added meshes without images" in edit.lines


def test_curves_whose_numbers_do_not_fit_are_refused(edit):
    def change(stage):
        define_wire(stage).GetCurveVertexCountsAttr().Set([3])

    with pytest.raises(StageError, match=r"Wire.curveVertexCounts: found \[3\], expected"):
        edit(change)


def test_an_added_mesh_inside_a_tile_moves_with_it(edit):
    def change(stage: Usd.Stage):
        define_arrow(stage, "/Specimen/Tiles/r0_c0/Arrow")
        UsdGeom.XformCommonAPI(stage.GetPrimAtPath("/Specimen/Tiles/r0_c0")).SetTranslate((0, 0, 9))

    bundle = edit(change)
    assert edit.lines == []
    (mesh,) = scene_of(bundle).values()
    assert mesh.bounds[:, 2] == pytest.approx([13, 13])


def test_an_added_mesh_in_a_channel_s_branch_of_a_tile_is_a_layer(edit):
    """Only the tile's payload defines the branch."""
    path = f"{BRANCH}/Arrow"
    bundle = edit(lambda stage: define_arrow(stage, path))
    assert edit.lines == []
    assert [one["id"] for one in load(bundle / "manifest.json")["additions"]["layers"]] == [path]


@pytest.mark.parametrize("arc", ["payload", "reference", "instance"])
def test_content_of_another_file_is_taken_over(edit, tmp_path, arc):
    """A turned and moved file in the specimen brings a mesh, a camera and a light."""
    kit = Usd.Stage.CreateNew(str(tmp_path / "kit.usda"))
    UsdGeom.SetStageUpAxis(kit, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(kit, 1e-6)
    kit.SetDefaultPrim(UsdGeom.Xform.Define(kit, "/Kit").GetPrim())
    define_arrow(kit, "/Kit/Arrow")
    UsdGeom.Camera.Define(kit, "/Kit/Eye").AddTranslateOp().Set(Gf.Vec3d(0, 0, 50))
    UsdLux.DistantLight.Define(kit, "/Kit/Sun")
    kit.Save()

    def change(stage):
        group = UsdGeom.Xform.Define(stage, "/Specimen/Kit")
        UsdGeom.XformCommonAPI(group).SetTranslate((0, 0, 20))
        group.AddRotateYOp().Set(90)
        prim = group.GetPrim()
        arcs = prim.GetPayloads() if arc == "payload" else prim.GetReferences()
        (arcs.AddPayload if arc == "payload" else arcs.AddReference)("./kit.usda")
        prim.SetInstanceable(arc == "instance")

    bundle = edit(change)
    assert edit.lines == []
    manifest = load(bundle / "manifest.json")
    assert [one["id"] for one in manifest["additions"]["layers"]] == ["/Specimen/Kit/Arrow"]
    (mesh,) = scene_of(bundle).values()
    # A turn by 90 degrees about y brings x to -z, and z to x.
    assert mesh.bounds == pytest.approx(np.array([(4, 0, 8), (4, 9, 12)]), abs=1e-4)
    (view,) = manifest["views"]
    assert view["position_um"] == pytest.approx([50, 0, 20], abs=1e-4)
    sun = next(lamp for lamp in manifest["lights"]["lamps"] if lamp["name"] == "Sun")
    assert sun["towards"] == pytest.approx([1, 0, 0], abs=1e-6)


def test_an_edit_in_a_payload_of_the_layer_is_reported(edit, tmp_path):
    kit = Usd.Stage.CreateNew(str(tmp_path / "kit.usda"))
    kit.SetDefaultPrim(UsdGeom.Xform.Define(kit, "/Kit").GetPrim())
    UsdGeom.Cube.Define(kit, "/Kit/Box")
    UsdGeom.SetStageUpAxis(kit, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(kit, 1e-6)
    kit.Save()
    edit(
        lambda s: (
            UsdGeom.Xform.Define(s, "/Specimen/Kit")
            .GetPrim()
            .GetPayloads()
            .AddPayload("./kit.usda")
        )
    )
    (line,) = edit.lines
    assert line.startswith("Cube /Specimen/Kit/Box is not taken over: the bundle uses no")


@pytest.mark.parametrize("scheme", ["none", "catmullClark"])
def test_a_polygonal_box_without_normals_has_sharp_edges(edit, scheme):
    """Storm shades such a box so. Without a scheme, a mesh is the cage of a smooth surface."""
    box = trimesh.creation.box((4, 4, 4))

    def change(stage):
        mesh = UsdGeom.Mesh.Define(stage, "/Specimen/Box")
        mesh.CreatePointsAttr([Gf.Vec3f(*map(float, point)) for point in box.vertices])
        mesh.CreateFaceVertexCountsAttr([3] * 12)
        mesh.CreateFaceVertexIndicesAttr([int(corner) for corner in box.faces.ravel()])
        mesh.CreateSubdivisionSchemeAttr(scheme)

    (mesh,) = scene_of(edit(change)).values()
    largest = np.abs(mesh.vertex_normals).max(axis=1)
    assert (largest > 0.999).all() if scheme == "none" else (largest < 0.9).all()
    assert trimesh.Trimesh(mesh.vertices, mesh.faces).volume == pytest.approx(64, rel=1e-4)


def test_prototypes_of_an_instancer_are_not_drawn_where_they_are_defined(edit):
    def change(stage):
        many = UsdGeom.PointInstancer.Define(stage, "/Specimen/Many")
        define_arrow(stage, "/Specimen/Many/Arrow")
        many.CreatePrototypesRel().AddTarget("/Specimen/Many/Arrow")
        many.CreateProtoIndicesAttr([0, 0])
        many.CreatePositionsAttr([Gf.Vec3f(0, 0, 5), Gf.Vec3f(9, 0, 5)])

    bundle = edit(change)
    assert "additions" not in load(bundle / "manifest.json")
    (line,) = edit.lines
    assert line.startswith("PointInstancer /Specimen/Many is not taken over")


def test_the_usdz_has_an_added_mesh_beside_the_specimen(stage, edit):
    """By USD's own boxes, its place among the specimen's meshes is the same as in the stage."""
    bundle = edit(define_arrow)
    purposes = [UsdGeom.Tokens.default_]
    small = Usd.Stage.Open(str(bundle / "specimen.usdz"))
    boxes = UsdGeom.BBoxCache(Usd.TimeCode.Default(), purposes)
    mesh = small.GetPrimAtPath("/Specimen/Annotations/addition0")
    assert mesh.GetDisplayName() == "Arrow"
    found = boxes.ComputeWorldBound(mesh).ComputeAlignedRange()
    ball = boxes.ComputeWorldBound(small.GetPrimAtPath("/Specimen/r0_c0")).ComputeAlignedRange()
    scale = small.GetRootLayer().customLayerData["stereocell"]["scale"] * 1e-6
    whole = Usd.Stage.Open(str(bundle.parent / "edited.usda"))
    boxes = UsdGeom.BBoxCache(Usd.TimeCode.Default(), purposes)
    arrow = boxes.ComputeWorldBound(whole.GetPrimAtPath("/Specimen/Annotations/Arrow"))
    leaf = whole.GetPrimAtPath("/Specimen/Tiles/r0_c0/CD31/CD31_r0_c0")
    surface = boxes.ComputeWorldBound(leaf).ComputeAlignedRange()
    expected = (arrow.ComputeAlignedRange().GetMin() - surface.GetMin()) * scale
    assert found.GetMin() - ball.GetMin() == pytest.approx(expected, abs=1e-3 * scale * 20)
    material = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()[0]
    surface = material.ComputeSurfaceSource()[0]
    assert tuple(surface.GetInput("diffuseColor").Get()) == (0, 0, 1)


def test_usds_default_subdivision_is_named(edit):
    def change(stage):
        define_arrow(stage).GetPrim().RemoveProperty("subdivisionScheme")

    edit(change)
    (line,) = edit.lines
    assert line.startswith("subdivision of /Specimen/Annotations/Arrow, which is USD's default")
