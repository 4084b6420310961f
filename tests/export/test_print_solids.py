"""Solids for printers are closed and have the right volume and unit, read by other libraries."""

import zipfile
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import lib3mf
import numpy as np
import pytest
import pyvista
import trimesh
from pxr import Gf, Usd, UsdGeom, Vt

from stereocell.export.cap import close_cuts
from stereocell.export.options import ExportOptions, parse_region
from stereocell.export.unite import cut_to, to_mesh, to_solid, unite, weld
from stereocell.export.write import export_stage
from stereocell.formats.body import Body
from stereocell.formats.threemf import write_3mf
from stereocell.meshes.clip import clip_mesh
from stereocell.model.errors import StageError
from stereocell.model.mesh import Mesh
from support import spheres

VOLUME_UM3 = 4 / 3 * np.pi * spheres.RADIUS**3
ENDINGS = ["stl", "3mf", "ply", "obj"]


def read(path: Path) -> trimesh.Trimesh:
    """Return a file's mesh with equal vertices joined. VTK reads PLY and OBJ, not trimesh."""
    if path.suffix == ".3mf":
        return trimesh.load(path, force="mesh", process=True)
    found = pyvista.read(path)
    return trimesh.Trimesh(found.points, found.faces.reshape(-1, 4)[:, 1:], process=True)


@pytest.mark.parametrize("ending", ENDINGS)
def test_two_tiles_become_one_closed_solid_of_the_sphere_s_volume(
    sphere_stage: Path, tmp_path: Path, ending: str
) -> None:
    path = tmp_path / f"s.{ending}"
    line = export_stage(sphere_stage, path, options=ExportOptions(scale=2000))
    found = read(path)
    assert found.is_watertight
    assert found.is_winding_consistent
    assert len(found.split()) == 1
    # At 2000 times the specimen, 1 um is 2 mm. The solid is made of chords inside the sphere.
    inside = VOLUME_UM3 * 2**3
    assert found.volume == pytest.approx(inside, rel=0.012)
    assert found.volume < inside
    assert np.ptp(found.bounds, axis=0) == pytest.approx([4 * spheres.RADIUS] * 3, rel=0.01)
    assert "14 x 14 x 14 mm, 2000 times the specimen" in line
    again = tmp_path / "again"
    again.mkdir()
    export_stage(sphere_stage, again / path.name, options=ExportOptions(scale=2000))
    assert (again / path.name).read_bytes() == path.read_bytes()


def test_volume_is_that_of_the_mesh_within_rounding(sphere_stage: Path, tmp_path: Path) -> None:
    rings, _ = spheres.LEVELS[0]
    parts = [spheres.sphere(rings, keep) for keep in (slice(0, rings + 1), slice(rings, None))]
    corners = np.concatenate([part.positions[part.triangles] for part in parts]).astype(float)
    exact = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    export_stage(sphere_stage, tmp_path / "s.stl", options=ExportOptions(scale=1000))
    assert read(tmp_path / "s.stl").volume == pytest.approx(exact, rel=1e-5)


def test_without_a_scale_it_fits_a_hand(sphere_stage: Path, tmp_path: Path) -> None:
    line = export_stage(sphere_stage, tmp_path / "s.stl", options=ExportOptions())
    assert "5000 times the specimen" in line  # from 20 um to 100 mm wide
    line = export_stage(
        sphere_stage, tmp_path / "s.stl", options=ExportOptions(scale=1, units="um")
    )
    assert read(tmp_path / "s.stl").volume == pytest.approx(VOLUME_UM3, rel=0.012)


def test_3mf_has_its_unit_by_its_own_library(sphere_stage: Path, tmp_path: Path) -> None:
    export_stage(sphere_stage, tmp_path / "s.3mf", options=ExportOptions(units="um", scale=1))
    model = lib3mf.get_wrapper().CreateModel()
    model.QueryReader("3mf").ReadFromFile(str(tmp_path / "s.3mf"))
    assert model.GetUnit() == lib3mf.ModelUnit.MicroMeter
    ends = model.GetOutbox()
    size = np.array(ends.MaxCoordinate) - np.array(ends.MinCoordinate)
    np.testing.assert_allclose(size, 2 * spheres.RADIUS, rtol=0.01)


def test_a_tile_and_a_region_are_cut_off_and_closed(sphere_stage: Path, tmp_path: Path) -> None:
    for options, share in (
        (ExportOptions(tiles=("r0_c0",), scale=1000), 0.5),
        (ExportOptions(region=parse_region(":,-5:,4:"), scale=1000), 0.25),
        (ExportOptions(tiles=("r0_c1",), region=parse_region(":,-5:,4:"), scale=1000), 0.125),
    ):
        export_stage(sphere_stage, tmp_path / "s.stl", options=options)
        found = read(tmp_path / "s.stl")
        assert found.is_watertight
        assert found.volume == pytest.approx(share * VOLUME_UM3, rel=0.02)


def test_parts_thinner_than_a_wall_are_named(sphere_stage: Path, tmp_path: Path) -> None:
    thick = ExportOptions(scale=1000, wall_mm=6.9)  # the ball is 7 mm thick
    assert "thinner" not in export_stage(sphere_stage, tmp_path / "s.stl", options=thick)
    thin = ExportOptions(scale=1000, wall_mm=7.1)
    line = export_stage(sphere_stage, tmp_path / "s.stl", options=thin).split("\n")[1]
    assert line.startswith("CD31: 1 of 1 bodies are thinner than 7.1 mm and may be lost in print:")
    assert "6.9 mm at (10, -5, 4)" in line or "7 mm at (10, -5, 4)" in line


def test_places_of_thin_parts_are_in_the_unit_of_the_file(
    sphere_stage: Path, tmp_path: Path
) -> None:
    thin = ExportOptions(scale=1000, wall_mm=7.1, units="m", channels=("CD31",))
    line = export_stage(sphere_stage, tmp_path / "s.obj", options=thin).split("\n")[1]
    assert line.endswith(" mm at (0.01, -0.005, 0.004)")
    assert read(tmp_path / "s.obj").centroid == pytest.approx((0.01, -0.005, 0.004), rel=0.02)


def test_solid_that_touches_itself_stays_closed_if_equal_vertices_are_joined() -> None:
    cube = trimesh.creation.box()
    faces = cube.faces.astype(np.uint32)
    for by in ((1.0, 1.0, 0.0), (1.0, 1.0, 1.0)):  # the cubes share an edge, then a corner
        places = (cube.vertices, cube.vertices + by)
        solids = [to_solid(at.astype(np.float32), faces, "cube") for at in places]
        found = trimesh.Trimesh(*to_mesh(unite(solids)), process=True)
        assert found.is_watertight
        assert len(found.split()) == 2
        assert found.volume == pytest.approx(2, rel=1e-4)


@pytest.mark.slow
def test_neighbours_of_hidden_and_moved_tiles_are_closed_at_the_cut(
    edited: Callable[..., Path], tmp_path: Path
) -> None:
    tile = "/Specimen/Tiles/r0_c1"
    half = VOLUME_UM3 / 2
    for change, volume, count in (
        (lambda s: UsdGeom.Imageable(s.GetPrimAtPath(tile)).MakeInvisible(), half, 1),
        (lambda s: _move(s, tile, (3, 0, 0)), 2 * half, 2),
        (lambda s: _move(s, tile, (0, 20, 0)), 2 * half, 2),
        (lambda s: _move(s, tile, (-1, 0, 0)), 2 * half - np.pi * spheres.RADIUS**2, 1),
    ):
        (tmp_path / "edited.usda").unlink(missing_ok=True)
        export_stage(edited(change), tmp_path / "s.stl", options=ExportOptions(scale=1000))
        found = read(tmp_path / "s.stl")
        assert found.is_watertight
        assert len(found.split()) == count
        assert found.volume == pytest.approx(volume, rel=0.03)


def _move(stage: Usd.Stage, tile: str, by: tuple[float, float, float]) -> None:
    UsdGeom.XformCommonAPI(stage.GetPrimAtPath(tile)).SetTranslate(by)


def test_a_corner_that_is_missing_is_closed_along_the_lines_where_planes_meet() -> None:
    ball = trimesh.creation.icosphere(3, 5.0)
    # Three of four quarters of one sphere, whose middle lies beside the cutting planes.
    planes = ((0, 0.7), (1, -0.4))
    parts = []
    for low, high in (
        ((-9, -9, -9), (0.7, -0.4, 9)),
        ((-9, -0.4, -9), (0.7, 9, 9)),
        ((0.7, -9, -9), (9, -0.4, 9)),
    ):  # fmt: skip
        normals = ball.vertex_normals.astype(np.float32)
        whole = Mesh(ball.vertices.astype(np.float32), ball.faces.astype(np.uint32), normals)
        part = clip_mesh(whole, low, high)
        places = np.round(part.positions, 4)
        for axis, value in planes:
            places[np.abs(places[:, axis] - value) < 1e-3, axis] = value
        parts.append((places.astype(np.float32), part.triangles))
    positions, triangles = weld(parts)
    closed = close_cuts(positions.astype(np.float64), triangles, planes)
    solid = to_solid(positions, closed, "x")
    whole = to_solid(ball.vertices.astype(np.float32), ball.faces.astype(np.uint32), "ball")
    boxes = [((-9, -9, -9), (0.7, 9, 9)), ((0.7, -9, -9), (9, -0.4, 9))]
    wanted = cut_to(whole, [(np.array(a, float), np.array(b, float)) for a, b in boxes]).volume()
    assert solid.volume() == pytest.approx(wanted, rel=2e-3)


@pytest.mark.slow
def test_a_surface_that_an_edit_opened_is_refused_in_a_line(
    edited: Callable[..., Path], tmp_path: Path
) -> None:
    def drop(stage: Usd.Stage) -> None:
        tile = stage.GetPrimAtPath("/Specimen/Tiles/r0_c0")
        lod = tile.GetVariantSet("lod")
        lod.SetVariantSelection("lod0")
        with lod.GetVariantEditContext():
            mesh = UsdGeom.Mesh(stage.GetPrimAtPath(f"{tile.GetPath()}/CD31/CD31_r0_c0"))
            corners = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
            mesh.GetFaceVertexIndicesAttr().Set(Vt.IntArray.FromNumpy(corners[100:].ravel()))
            mesh.GetFaceVertexCountsAttr().Set(Vt.IntArray(len(corners) - 100, 3))

    with pytest.raises(StageError, match=r"CD31: found \d+ open edges, one at \("):
        export_stage(edited(drop), tmp_path / "s.stl", options=ExportOptions())
    assert not (tmp_path / "s.stl").exists()


def test_a_whole_specimen_that_was_turned_stays_closed(
    edited: Callable[..., Path], tmp_path: Path
) -> None:
    def turn(stage: object) -> None:
        tiles = UsdGeom.XformCommonAPI(stage.GetPrimAtPath("/Specimen/Tiles"))
        tiles.SetRotate(Gf.Vec3f(20, 30, 40))

    export_stage(edited(turn), tmp_path / "s.stl", options=ExportOptions(scale=1000))
    found = read(tmp_path / "s.stl")
    assert found.is_watertight
    assert found.volume == pytest.approx(VOLUME_UM3, rel=0.012)


def test_cut_through_vertices_leaves_no_solid_that_touches_itself() -> None:
    cube = trimesh.creation.icosphere(3, 1.0)
    solid = to_solid(*weld([(cube.vertices.astype(np.float32), cube.faces.astype(np.uint32))]), "x")
    boxes = [
        (np.array([0.0, -2, -2]), np.array([2.0, 0, 2])),
        (np.array([-2.0, 0, -2]), np.array([0.0, 2, 2])),
        (np.array([0.0, 0, -2]), np.array([2.0, 2, 2])),
    ]
    mesh = cut_to(solid, boxes).to_mesh()
    places = mesh.vert_properties[:, :3]
    assert len(np.unique(places, axis=0)) == len(places)
    assert cut_to(solid, boxes).volume() == pytest.approx(0.75 * solid.volume(), rel=2e-3)


def test_3mf_may_contain_any_name(tmp_path: Path) -> None:
    cube = trimesh.creation.box()
    name = 'a<b> & "c"\x01\N{GREEK SMALL LETTER EPSILON}'
    body = Body(name, (1, 2, 3), cube.vertices.astype(np.float32), cube.faces.astype(np.uint32))
    wanted = name.replace("\x01", "\ufffd")
    for components, settings in ((False, "Slic3r_PE_model"), (True, "model_settings")):
        write_3mf(tmp_path / "c.3mf", [body], title=name, unit="mm", components=components)
        model = lib3mf.get_wrapper().CreateModel()
        model.QueryReader("3mf").ReadFromFile(str(tmp_path / "c.3mf"))
        objects = model.GetObjects()
        assert objects.MoveNext()
        assert objects.GetCurrentObject().GetName() == wanted
        with zipfile.ZipFile(tmp_path / "c.3mf") as archive:
            found = ElementTree.fromstring(archive.read(f"Metadata/{settings}.config"))
        names = [one.get("value") for one in found.iter("metadata") if one.get("key") == "name"]
        assert names == [wanted, wanted]
