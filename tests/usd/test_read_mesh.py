import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, Vt

from stereocell.model.errors import StageError
from stereocell.usd.read_mesh import read_mesh

CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float32)
# counter-clockwise seen from outside
QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


@pytest.fixture
def cube():
    stage = Usd.Stage.CreateInMemory()
    mesh = UsdGeom.Mesh.Define(stage, "/Cube")
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(CUBE))
    mesh.CreateFaceVertexCountsAttr([4] * 6)
    mesh.CreateFaceVertexIndicesAttr([i for quad in QUADS for i in quad])
    yield mesh  # a mesh dies with its stage
    del stage


def volume(mesh):
    a, b, c = (mesh.positions[mesh.triangles[:, i]].astype(float) for i in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def moved(**rows):
    matrix = np.eye(4)
    for name, values in rows.items():
        matrix["xyzt".index(name), :3] = values
    return matrix


def test_quads_become_triangles_that_enclose_the_same_volume(cube):
    mesh = read_mesh(cube, np.eye(4))
    assert mesh.triangles.shape == (12, 3)
    assert volume(mesh) == pytest.approx(1)


def test_polygons_of_any_size_are_cut_into_fans(cube):
    hexagon = [Gf.Vec3f(np.cos(a), np.sin(a), 0) for a in np.arange(6) * np.pi / 3]
    cube.GetPointsAttr().Set([*hexagon, Gf.Vec3f(3, 0, 0), Gf.Vec3f(3, 1, 0)])
    cube.GetFaceVertexCountsAttr().Set([6, 3])
    cube.GetFaceVertexIndicesAttr().Set([0, 1, 2, 3, 4, 5, 0, 6, 7])
    mesh = read_mesh(cube, np.eye(4))
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5], [0, 6, 7]]


def test_a_face_of_a_million_corners_is_refused_in_a_line(cube):
    count = 1_000_000
    cube.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(np.zeros((count, 3), np.float32)))
    cube.GetFaceVertexCountsAttr().Set([3, count])
    cube.GetFaceVertexIndicesAttr().Set(Vt.IntArray.FromNumpy(np.arange(count + 3) % count))
    with pytest.raises(StageError) as caught:
        read_mesh(cube, np.eye(4))
    assert str(caught.value) == (
        "/Cube: faceVertexCounts[1]: found a face of 1000000 corners, expected at most 20000: "
        "triangulate it in the program that edited it"
    )


def test_missing_normals_are_made_and_point_out(cube):
    mesh = read_mesh(cube, np.eye(4))
    outward = mesh.positions - 0.5
    assert ((mesh.normals * outward).sum(1) > 0.5).all()


def test_left_handed_meshes_are_turned_over(cube):
    cube.CreateOrientationAttr(UsdGeom.Tokens.leftHanded)
    assert volume(read_mesh(cube, np.eye(4))) == pytest.approx(-1)


def test_values_of_face_corners_split_vertices(cube):
    st = UsdGeom.PrimvarsAPI(cube).CreatePrimvar(
        "st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.faceVarying
    )
    st.Set(Vt.Vec2fArray([(0, 0), (1, 0), (1, 1), (0, 1)] * 6))
    cube.CreateNormalsAttr([(-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0), (0, 0, -1), (0, 0, 1)])
    cube.SetNormalsInterpolation(UsdGeom.Tokens.uniform)
    mesh = read_mesh(cube, np.eye(4))
    assert len(mesh.positions) == 24  # each corner of the cube once a face
    assert volume(mesh) == pytest.approx(1)
    assert mesh.uvs.shape == (24, 2)
    a, b, c = (mesh.positions[mesh.triangles[:, i]] for i in range(3))
    facing = np.cross(b - a, c - a)
    assert np.allclose(mesh.normals[mesh.triangles[:, 0]], facing)


def test_indexed_values_are_looked_up(cube):
    st = UsdGeom.PrimvarsAPI(cube).CreatePrimvar(
        "st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex
    )
    st.Set(Vt.Vec2fArray([(0.25, 0.5), (0.75, 0.5)]))
    st.SetIndices(Vt.IntArray([0, 1] * 4))
    assert read_mesh(cube, np.eye(4)).uvs[:, 0].tolist() == [0.25, 0.75] * 4


def test_moving_keeps_normals_upright(cube):
    mesh = read_mesh(cube, moved(x=(4, 0, 0), t=(7, 8, 9)))
    assert mesh.positions.min(0).tolist() == [7, 8, 9]
    assert mesh.positions.max(0).tolist() == [11, 9, 10]
    still = read_mesh(cube, np.eye(4))
    expected = still.normals / (4, 1, 1)
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    assert np.allclose(mesh.normals, expected)


def test_mirroring_turns_the_faces_over(cube):
    mesh = read_mesh(cube, moved(x=(-1, 0, 0)))
    assert volume(mesh) == pytest.approx(1)
    assert ((mesh.normals * (mesh.positions - (-0.5, 0.5, 0.5))).sum(1) > 0).all()


def test_mesh_without_faces_is_none(cube):
    cube.GetFaceVertexCountsAttr().Set([])
    cube.GetFaceVertexIndicesAttr().Set([])
    assert read_mesh(cube, np.eye(4)) is None


@pytest.mark.parametrize(
    ("counts", "indices", "words"),
    [
        ([4], [0, 1, 2], "found 3 faceVertexIndices, expected 4"),
        ([3], [0, 1, 8], "from 0 to 8, expected 0 to 7"),
        ([3], [-1, 0, 1], "from -1 to 1, expected 0 to 7"),
        ([2], [0, 1], "found a face of 2 corners, expected at least 3"),
    ],
)
def test_contradictions_are_named(cube, counts, indices, words):
    cube.GetFaceVertexCountsAttr().Set(counts)
    cube.GetFaceVertexIndicesAttr().Set(indices)
    with pytest.raises(StageError, match=f"/Cube: .*{words}"):
        read_mesh(cube, np.eye(4))


def test_wrong_number_of_normals_is_named(cube):
    cube.CreateNormalsAttr([(0, 0, 1)] * 3)
    with pytest.raises(StageError, match="/Cube: found 3 normals, expected 8"):
        read_mesh(cube, np.eye(4))
