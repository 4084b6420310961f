"""Levels of meshes that are edited by hand over the stage are made again, or named."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, Vt

from stereocell.bundle.edited_meshes import shown_lods
from stereocell.model.channel import PaintColors
from stereocell.model.errors import StereoCellError
from stereocell.model.mesh import Baked, Lod
from stereocell.usd.read_stage import loaded, open_stage
from stereocell.usd.write_stage import TileExtent, write_stage, write_tile
from support import spheres
from support.bundles import chain, channel, files, load, write
from support.glbs import decoded_positions_m, read
from support.stages import HEAD, edit_over

MESH = "/Specimen/Tiles/r0_c0/CD31/CD31_r0_c0"


def in_level(stage, level, change):
    """Change the mesh of r0_c0 inside one variant, without selecting the variant."""
    variants = stage.GetPrimAtPath("/Specimen/Tiles/r0_c0").GetVariantSet("lod")
    variants.SetVariantSelection(level)
    with variants.GetVariantEditContext():
        change(UsdGeom.Mesh(stage.GetPrimAtPath(MESH)))
    variants.ClearVariantSelection()


def set_points(mesh, move):
    points = np.array(mesh.GetPointsAttr().Get(), np.float64)
    mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(move(points).astype(np.float32)))


def swell(factor):
    """Return a function that enlarges a tile's mesh about the sphere's centre.

    The cut stays in its plane, because the plane contains the centre.
    """
    return lambda mesh: set_points(mesh, lambda p: spheres.CENTER + factor * (p - spheres.CENTER))


RISE = 1.1 * 0.5  # um, lod2's error; to keep the volume, vertices may lie this far outside


def radii(bundle, level, shift_um=(0, 0, 0)):
    """Return the distances, um, of the vertices of r0_c0 from the sphere's centre."""
    points = decoded_positions_m((bundle / f"channels/CD31/r0_c0/{level}.glb").read_bytes())
    return np.linalg.norm(points * 1e6 - shift_um - spheres.CENTER, axis=1)


def errors_um(bundle):
    """Return the errors that the tileset states for r0_c0, um, by level."""
    found, waiting = {}, [load(bundle / channel(bundle)["tileset"]["path"])["root"]]
    while waiting:
        entry = waiting.pop()
        waiting += entry.get("children", [])
        folder, _, level = entry.get("content", {}).get("uri", "").partition("/")
        if folder == "r0_c0":
            found[level.removesuffix(".glb")] = entry["geometricError"] * 1e6
    return found


@pytest.mark.slow
def test_a_stage_without_hashes_or_edits_gives_the_same_bundle(bundle, stage, edit, tmp_path):
    assert files(edit(lambda s: None)) == files(bundle)
    assert edit.lines == []
    shutil.copytree(stage.parent, tmp_path / "old")
    for tile in (tmp_path / "old").rglob("tile.usdc"):
        layer = Sdf.Layer.FindOrOpen(str(tile))
        found = []
        layer.Traverse("/", lambda path, found=found: found.append(path))
        hashes = [path for path in found if path.name == "stereocell:shapeHash"]
        assert len(hashes) == len(spheres.LEVELS)
        for path in hashes:
            owner = layer.GetPrimAtPath(path.GetPrimOrPrimVariantSelectionPath())
            owner.RemoveProperty(layer.GetAttributeAtPath(path))
        layer.Save()
    lines = write(tmp_path / "old/stage.usda", tmp_path / "from_old")
    assert lines == []
    assert files(tmp_path / "from_old") == files(bundle)


@pytest.mark.slow
def test_coarser_levels_are_made_again_from_an_edited_finest_level(bundle, edit):
    edited = edit(lambda s: in_level(s, "lod0", swell(1.25)))
    large = 1.25 * spheres.RADIUS
    assert np.abs(radii(edited, "lod0") - large).max() < 0.01
    for level in ("lod1", "lod2"):
        assert np.abs(radii(edited, level) - large).max() < RISE
    stated = errors_um(edited)
    # Chords of the finest level are within .3 um of the sphere, which all levels now approximate.
    assert 0 == stated["lod0"] < stated["lod1"] <= stated["lod2"] < 1
    assert stated["lod1"] != errors_um(bundle)["lod1"]
    other = "channels/CD31/r0_c1/lod1.glb"
    (line,) = edit.lines
    assert line.startswith("r0_c0/CD31: edited by hand: lod0 (sound); rebuilt from lod0: lod1 ")
    assert "lod2 within" in line
    assert read((edited / other).read_bytes())[0]["meshes"]  # the neighbour is not touched
    assert chain(edited, "r0_c1") == chain(bundle, "r0_c1")
    # The stage states no settings, so lod1 is made with the defaults: without maps.
    document, _ = read((edited / "channels/CD31/r0_c0/lod1.glb").read_bytes())
    (primitive,) = document["meshes"][0]["primitives"]
    assert "TEXCOORD_0" not in primitive["attributes"]
    assert "images" not in document


@pytest.mark.slow
def test_remade_levels_have_the_cut_of_the_edited_level(edit):
    edited = edit(lambda s: in_level(s, "lod0", swell(1.25)))
    cut = {}
    for level in ("lod0", "lod1"):
        data = (edited / f"channels/CD31/r0_c0/{level}.glb").read_bytes()
        points = decoded_positions_m(data) * 1e6
        cut[level] = {tuple(p) for p in points[np.abs(points[:, 0] - 10) < 1e-3].round(4)}
    assert len(cut["lod0"]) > 8
    assert cut["lod0"] == cut["lod1"]


def test_an_edited_coarser_level_stays_and_states_its_distance(bundle, edit):
    edited = edit(lambda s: in_level(s, "lod1", swell(1.25)))
    assert np.abs(radii(edited, "lod1") - 1.25 * spheres.RADIUS).max() < 0.01
    for level in ("lod0", "lod2"):
        name = f"channels/CD31/r0_c0/{level}.glb"
        assert (edited / name).read_bytes() == (bundle / name).read_bytes()
    stated = errors_um(edited)
    assert stated["lod1"] == pytest.approx(0.25 * spheres.RADIUS + 0.02, rel=0.1)
    assert stated["lod2"] >= stated["lod1"]
    (line,) = edit.lines
    assert "lod1 (sound) " in line
    assert line.endswith(" um from lod0, which has no edits")


def test_other_levels_that_the_artist_edited_stay(edit):
    def change(stage):
        in_level(stage, "lod0", swell(1.25))
        in_level(stage, "lod2", swell(1.5))

    edited = edit(change)
    assert np.abs(radii(edited, "lod1") - 1.25 * spheres.RADIUS).max() < RISE
    assert np.abs(radii(edited, "lod2") - 1.5 * spheres.RADIUS).max() < 0.05
    assert errors_um(edited)["lod2"] == pytest.approx(0.25 * spheres.RADIUS, rel=0.2)
    (line,) = edit.lines
    assert "lod2 (sound) is kept, " in line


def box_mesh(mesh):
    """Replace a mesh by an octahedron, which has another topology."""
    points = spheres.CENTER - (2.0, 0, 0) + 1.5 * np.array(
        [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    )  # fmt: skip
    faces = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    mesh.GetPointsAttr().Set([Gf.Vec3f(*p) for p in points])
    mesh.GetFaceVertexCountsAttr().Set([3] * 8)
    mesh.GetFaceVertexIndicesAttr().Set([i for face in faces for i in face])
    mesh.GetNormalsAttr().Set([Gf.Vec3f(*(p - points.mean(axis=0)) / 1.5) for p in points])


@pytest.mark.parametrize("place", ["in lod0", "over all levels"])
def test_another_topology_reaches_all_levels(edit, place):
    def change(stage):
        if place == "in lod0":
            in_level(stage, "lod0", box_mesh)
        else:
            box_mesh(UsdGeom.Mesh(stage.GetPrimAtPath(MESH)))

    edited = edit(change)
    away = spheres.CENTER - (2.0, 0, 0)
    for level in chain(edited, "r0_c0"):
        data = (edited / f"channels/CD31/r0_c0/{level}").read_bytes()
        places = decoded_positions_m(data) * 1e6 - away
        assert np.abs(np.abs(places).sum(axis=1) - 1.5).max() < 0.05
    assert channel(edited)["triangles"][0] > 8  # includes the neighbour's triangles
    (line,) = edit.lines
    assert "lod0 (sound)" in line


@pytest.mark.slow
def test_faults_of_an_edited_mesh_are_reported(edit):
    def open_it(mesh):
        mesh.GetFaceVertexCountsAttr().Set(list(mesh.GetFaceVertexCountsAttr().Get())[:-40])
        mesh.GetFaceVertexIndicesAttr().Set(list(mesh.GetFaceVertexIndicesAttr().Get())[:-120])

    edit(lambda s: in_level(s, "lod0", open_it))
    assert " open edges" in edit.lines[0]

    def cross_it(mesh):
        far = spheres.CENTER - (3.3, 0, 0)
        near = spheres.CENTER - (0.5, 0, -9.0)

        def move(points):
            points[np.linalg.norm(points - far, axis=1) < 1] = near
            return points

        set_points(mesh, move)

    edit(lambda s: in_level(s, "lod0", cross_it))
    assert " crossings" in edit.lines[0] or "without area" in edit.lines[0]


def empty(mesh):
    mesh.GetFaceVertexCountsAttr().Set([])
    mesh.GetFaceVertexIndicesAttr().Set([])


@pytest.mark.parametrize(
    ("level", "change", "left", "expected"),
    [
        ("lod0", empty, [], ["lod0 is empty, so no surface is left"]),
        ("lod1", empty, ["lod2.glb", "lod0.glb"], ["lod1 is empty and left out"]),
        ("lod0", lambda mesh: mesh.GetPrim().SetActive(False), ["lod2.glb", "lod1.glb"], []),
    ],
)
def test_emptied_or_inactive_level_is_left_out(edit, level, change, left, expected):
    edited = edit(lambda s: in_level(s, level, change))
    if left:
        assert chain(edited, "r0_c0") == left
    else:
        assert not (edited / "channels/CD31/r0_c0").exists()
    assert edit.lines == [f"r0_c0/CD31: edited by hand: {line}" for line in expected]


def test_a_mesh_that_is_moved_as_a_whole_keeps_its_levels(bundle, edit):
    edited = edit(
        lambda s: UsdGeom.XformCommonAPI(s.GetPrimAtPath(MESH)).SetTranslate((-1, 2, 0.5))
    )
    assert edit.lines == []
    assert errors_um(edited) == errors_um(bundle)
    assert np.abs(radii(edited, "lod1", (-1, 2, 0.5)) - spheres.RADIUS).max() < 0.01


def test_a_transform_of_the_finest_level_alone_is_an_edit(edit):
    edited = edit(
        lambda s: in_level(
            s, "lod0", lambda mesh: UsdGeom.XformCommonAPI(mesh).SetTranslate((-1, 2, 0.5))
        )
    )
    for level in ("lod0", "lod1", "lod2"):
        assert np.abs(radii(edited, level, (-1, 2, 0.5)) - spheres.RADIUS).max() < RISE
    assert "rebuilt from lod0: lod1" in edit.lines[0]


@pytest.mark.slow
def test_edit_in_place_and_flattened_edit_are_recognised(stage, edit, tmp_path):
    shutil.copytree(stage.parent, tmp_path / "own")
    own = Usd.Stage.Open(str(tmp_path / "own/tiles/r0_c0/tile.usdc"))
    variants = own.GetDefaultPrim().GetVariantSet("lod")
    variants.SetVariantSelection("lod0")
    with variants.GetVariantEditContext():
        swell(1.25)(UsdGeom.Mesh(own.GetPrimAtPath("/r0_c0/CD31/CD31_r0_c0")))
    variants.SetVariantSelection("lod1")
    own.GetRootLayer().Save()
    lines = write(tmp_path / "own/stage.usda", tmp_path / "a")
    (line,) = lines
    assert "lod0 (sound); rebuilt from lod0: lod1" in line
    assert np.abs(radii(tmp_path / "a", "lod2") - 1.25 * spheres.RADIUS).max() < RISE

    edit(lambda s: in_level(s, "lod0", swell(1.25)))
    whole = Usd.Stage.Open(str(tmp_path / "edited.usda"))
    tile = whole.GetPrimAtPath("/Specimen/Tiles/r0_c0")
    tile.GetVariantSet("lod").SetVariantSelection("lod0")
    whole.Export(str(tmp_path / "flat.usda"))
    lines = write(tmp_path / "flat.usda", tmp_path / "flat")
    assert (
        "flat.usda: found a flattened stage, which hides the edits that no bundle takes over"
        in lines[0]
    )
    assert lines[1:] == ["r0_c0/CD31: edited by hand: lod0 (sound)"]


def test_points_in_other_units_are_reported(stage, tmp_path):
    layer = Sdf.Layer.CreateNew(str(tmp_path / "an artist's.usda"))
    layer.subLayerPaths = [str(stage)]
    over = Usd.Stage.Open(layer)
    in_level(over, "lod0", swell(1.25))
    layer.pseudoRoot.SetInfo("metersPerUnit", 0.01)
    layer.Save()
    root = Sdf.Layer.CreateNew(str(tmp_path / "root.usda"))
    root.ImportFromString(f"{HEAD})\n")
    specimen = Sdf.CreatePrimInLayer(root, "/Specimen")
    specimen.specifier = Sdf.SpecifierDef
    specimen.referenceList.prependedItems = [Sdf.Reference("./an artist's.usda", "/Specimen")]
    root.Save()
    lines = write(tmp_path / "root.usda", tmp_path / "bundle")
    (line,) = lines
    assert "points of an artist's.usda, whose metersPerUnit is 0.01, are taken as um" in line


def test_points_that_are_not_numbers_are_refused(edit):
    def spoil(mesh):
        set_points(mesh, lambda points: np.where(points > 9.9, np.nan, points))

    with pytest.raises(
        StereoCellError, match=r"CD31_r0_c0.points: found nan, expected finite numbers"
    ):
        edit(lambda s: in_level(s, "lod0", spoil))


@pytest.mark.slow
@pytest.mark.parametrize("first_lod", [1, 2])
def test_remade_levels_have_occlusion_and_paint_of_the_edited_level(tmp_path, first_lod):
    """By the stage's settings, lod1 has maps, or values at its vertices."""
    tile = spheres.tile(0)
    (painted, *others) = tile.channels
    lods = []
    for lod in painted.lods:
        bare = replace(lod.mesh, uvs=None, tangents=None)
        high, front = (bare.positions[:, k] > spheres.CENTER[k] for k in (1, 2))
        baked = Baked(np.where(high, 128, 255).astype(np.uint8), front.astype(np.uint8) * 255)
        lods.append(Lod(bare, lod.distance_um, None, None, baked))
    colors = PaintColors((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    painted = replace(painted, lods=tuple(lods), paint=colors)
    tile = replace(tile, channels=(painted, *others))
    write_tile(tmp_path, tile)
    settings = {
        "lod": {"errors": [0.1, 0.5, 0.8]},
        "unwrap": {"maps": True, "first_lod": first_lod},
    }
    appearances = (replace(spheres.RED, painted_by="Hoechst_x20_33342"), spheres.BLUE)
    write_stage(
        tmp_path,
        "one",
        appearances=appearances,
        tiles=[TileExtent.of(tile)],
        provenance={"settings": settings},
    )
    path = edit_over(
        tmp_path / "edit.usda", "./stage.usda", lambda s: in_level(s, "lod0", swell(1.25))
    )
    lines = write(path, tmp_path / "bundle")
    (line,) = lines
    assert "rebuilt from lod0: lod1" in line
    with loaded(open_stage(tmp_path / "edit.usda"), "r0_c0") as (prim, _):
        _, lod, _ = shown_lods(prim, "CD31").lods
    assert lod.material.color == (1, 1, 1)
    if first_lod == 1:
        color, openness = lod.images.color / 255, lod.images.occlusion / 255
    else:
        assert lod.images is None
        color, openness = lod.mesh.colors, lod.mesh.openness
    # One half is red, the other green, with a sharp border.
    for share in (color[..., 0], color[..., 1]):
        assert 0.3 < (share > 0.9).mean() < 0.7
    assert 0.3 < (np.abs(openness - 128 / 255) < 0.02).mean() < 0.7
    assert 0.3 < (openness > 0.98).mean() < 0.7
