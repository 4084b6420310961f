"""Two-dimensional transfer functions: the table, the stage, the bundle and the viewer's copy."""

import json
import shutil
import subprocess
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
import zstandard
from jsonschema import Draft202012Validator
from numpy.typing import NDArray
from pxr import Gf, Sdf, Usd, Vt

from stereocell.building.out_folder import OutFolder
from stereocell.building.survey_file import read_survey
from stereocell.cli.__main__ import main
from stereocell.engine.run import Engine
from stereocell.model.channel import Shape, Shapes, TransferFunctions2d
from stereocell.model.errors import StageError
from stereocell.storage.assets import find_asset, schema_path
from stereocell.transfer.joint_histogram import COLUMNS, ROWS, count_joint, log_scaled
from stereocell.transfer.opacity import evaluate
from stereocell.transfer.shapes2d import (
    MAX_SHAPES,
    NAME,
    evaluate2d,
    fall_back,
    find_fault,
    shapes_from,
)
from stereocell.usd.read_appearances import read_appearances
from stereocell.usd.read_stage import open_stage
from stereocell.usd.write_stage import TileExtent, write_stage, write_tile
from stereocell.verify.check_line import CheckLine
from stereocell.verify.formats import check
from support import spheres
from support.bundles import channel, load, write_bundle
from support.phantoms import as_counts, blurred_ball, write_ome_tiff

RECTANGLE = Shape("rectangle", (0.25, 1.0), (0.25, 1.0), 0.625, (1.0, 0.5, 0.0), 0.5, 1.0)
TRIANGLE = Shape("triangle", (0.0, 1.0), (0.0, 1.0), 0.5, (0.0, 0.0, 1.0), 1.0, 1.0)
# An appearance with a 2D function whose numbers float32 cannot hold exactly
SHAPES: Shapes = (
    Shape("triangle", (0.2, 0.7), (0.1, 0.9), 0.45, (1.0, 0.3, 0.1), 0.35, 0.5),
    Shape("rectangle", (0.6, 0.95), (0.0, 0.2), 0.775, (1.0, 1.0, 1.0), 0.05, 0.25),
)
LOOK = replace(
    spheres.RED,
    transfer_functions={**spheres.RED.transfer_functions, NAME: fall_back(SHAPES)},
    transfer_2d=TransferFunctions2d(gradient_max=0.37, functions={NAME: SHAPES}),
)
APPEARANCES = (LOOK, spheres.BLUE)
TILES = tuple(spheres.tile(column, APPEARANCES) for column in (0, 1))
CD31 = "/Specimen/Channels/CD31"


# The table, by hand, for values and gradients 0, 1/4, 1/2, 3/4, 1. See docs/transfer-functions.md.


def test_a_rectangle_fades_towards_its_edges_but_not_at_the_ends_of_the_plane() -> None:
    table = evaluate2d((RECTANGLE,), size=(5, 5))
    # Across: 0 at 1/4, 2/3 at 1/2, then 1. Up: 0 at 1/4, 2/3 at 1/2, then 1. Times .5, times 255.
    assert table[..., 3].tolist() == [
        [0, 0, 0, 0, 0],
        [0, 0, 0, 0, 0],
        [0, 0, 57, 85, 85],
        [0, 0, 85, 128, 128],
        [0, 0, 85, 128, 128],
    ]
    assert table[3, :, :3].tolist() == [[255] * 3] * 2 + [[255, 128, 0]] * 3


def test_a_triangle_widens_from_its_tip() -> None:
    assert evaluate2d((TRIANGLE,), size=(5, 5))[..., 3].tolist() == [
        [0, 0, 255, 0, 0],
        [0, 0, 255, 0, 0],
        [0, 0, 255, 0, 0],
        [0, 85, 255, 85, 0],
        [0, 128, 255, 128, 0],
    ]


def test_overlapping_shapes_mix_their_colours_by_opacity() -> None:
    # 1/3 of (1, 1/2, 0) plus 1 of (0, 0, 1), divided by 4/3
    assert evaluate2d((RECTANGLE, TRIANGLE), size=(5, 5))[4, 2].tolist() == [64, 32, 191, 255]
    half = replace(RECTANGLE, values=(0.0, 1.0), gradients=(0.0, 1.0))
    # Two shapes that absorb a half each absorb three quarters together.
    assert (evaluate2d((half, half))[..., 3] == np.floor(0.75 * 255 + 0.5)).all()


def test_without_shapes_the_table_is_clear_and_white() -> None:
    table = evaluate2d(())
    assert table.shape == (ROWS, COLUMNS, 4)
    assert (table == [255, 255, 255, 0]).all()


def test_the_fallback_is_a_transfer_function_that_shows_the_shapes_values() -> None:
    points = fall_back(SHAPES)
    values = np.array(points)[:, 0]
    assert (values[0], values[-1]) == (0, 1)
    assert (np.diff(values) > 0).all()
    table = evaluate(points)
    assert table[[20, 45, 255]].tolist() == [0, 0, 0]
    assert table[round(0.45 * 255)] == pytest.approx(0.35, abs=1e-3)
    assert fall_back(()) == ((0.0, 0.0), (1.0, 0.0))


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"kind": "disc"}, "kind is 'disc', expected one of rectangle, triangle"),
        ({"values": (0.5, 0.5)}, r"values are (0.5, 0.5), expected them to rise within 0..1"),
        ({"values": (0.5, 1.5)}, r"values are (0.5, 1.5), expected them to rise within 0..1"),
        ({"gradients": (-0.1, 1.0)}, r"gradients are (-0.1, 1), expected them to rise within 0..1"),
        ({"gradients": (float("nan"), 1.0)}, "gradients are (nan, 1), expected them to rise"),
        ({"tip": 2.0}, "tip is 2, expected 0..1"),
        ({"opacity": -1.0}, "opacity is -1, expected 0..1"),
        ({"softness": float("nan")}, "softness is nan, expected 0..1"),
        ({"color": (0.0, 9.0, 0.0)}, "color.g is 9, expected 0..1"),
    ],
)
def test_a_faulty_shape_is_reported(change: dict[str, object], fault: str) -> None:
    assert find_fault(TRIANGLE) == ""
    assert find_fault(replace(TRIANGLE, **change)).startswith(fault)


def random_shapes(seed: int) -> Shapes:
    rng = np.random.default_rng(seed)
    shapes = []
    for i in range(rng.integers(1, 6)):
        ends = np.sort(rng.random((2, 2)), axis=1)
        if rng.random() < 0.5:  # at the ends of the plane
            ends[:, rng.integers(2)] = rng.integers(2)
            ends = np.sort(ends, axis=1)
        (v0, v1), (g0, g1) = ends.tolist()
        soft = float(rng.choice([0.0, 1.0, rng.random()]))
        r, g, b, opacity, tip = rng.random(5).tolist()
        kind = ("rectangle", "triangle")[i % 2]
        shape = Shape(kind, (v0, v1), (g0, g1), tip, (r, g, b), opacity, soft)
        shapes += [shape] if not find_fault(shape) else []
    return tuple(shapes)


VIEWER = find_asset("viewer_gltf")


@pytest.mark.slow
@pytest.mark.skipif(
    shutil.which("node") is None or not (VIEWER / "node_modules" / "tsx").is_dir(),
    reason="needs node and the viewer's packages: run `make setup`",
)
def test_the_viewer_makes_the_same_bytes(tmp_path: Path) -> None:
    cases = [SHAPES, (RECTANGLE, TRIANGLE), *(random_shapes(seed) for seed in range(40))]
    assert sum(map(len, cases)) > 60
    twin = (VIEWER / "src/state/transfer_shapes.ts").as_posix()
    (tmp_path / "twin.ts").write_text(
        f'import {{ rasterise }} from "{twin}";\n'
        'import { readFileSync, writeFileSync } from "node:fs";\n'
        'const cases = JSON.parse(readFileSync(process.argv[2], "utf8"));\n'
        "writeFileSync(process.argv[3], Buffer.concat(cases.map((c: never) => rasterise(c))));\n"
    )
    (tmp_path / "cases.json").write_text(json.dumps([[asdict(s) for s in case] for case in cases]))
    files = [str(tmp_path / name) for name in ("twin.ts", "cases.json", "tables.bin")]
    subprocess.run(
        [str(VIEWER / "node_modules/.bin/tsx"), *files], check=True, timeout=60, cwd=VIEWER
    )
    made = np.fromfile(files[2], np.uint8).reshape(len(cases), ROWS, COLUMNS, 4)
    for table, case in zip(made, cases, strict=True):
        assert np.array_equal(table, evaluate2d(case)), case


# The stage, and an artist's layer over it


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write the stage of two tiles with a 2D function; tests only read it."""
    folder = tmp_path_factory.mktemp("stage")
    for tile in TILES:
        write_tile(folder, tile)
    write_stage(
        folder,
        "two tiles",
        appearances=APPEARANCES,
        tiles=[TileExtent.of(tile) for tile in TILES],
        provenance={},
    )
    return folder / "stage.usda"


def edit(stage: Path, folder: Path, variant: str = NAME, **arrays: object) -> Path:
    """Return a layer over the stage that sets attributes `stereocell:...` in a variant of CD31.

    gradientMax is set outside of variants, as in the stage.
    """
    layer = Sdf.Layer.CreateNew(str(folder / "edit.usda"))
    layer.subLayerPaths = [str(stage)]
    over = Usd.Stage.Open(layer)
    prim = over.GetPrimAtPath(CD31)
    if "gradientMax" in arrays:
        prim.GetAttribute("stereocell:gradientMax").Set(arrays.pop("gradientMax"))
    variants = prim.GetVariantSet("transferFunction")
    variants.AddVariant(variant)
    variants.SetVariantSelection(variant)
    with variants.GetVariantEditContext():
        for name, value in arrays.items():
            prim.GetAttribute(f"stereocell:{name}").Set(value)
    layer.Save()
    return folder / "edit.usda"


def test_the_stage_returns_the_shapes_unchanged(stage: Path) -> None:
    red, blue = read_appearances(open_stage(stage))
    assert red.transfer_2d == LOOK.transfer_2d
    assert list(red.transfer_functions) == ["default", NAME, "sharp"]
    assert blue.transfer_2d == TransferFunctions2d()


def test_attributes_that_an_artist_omits_have_their_defaults(stage: Path, tmp_path: Path) -> None:
    path = edit(
        stage,
        tmp_path,
        "sharp",
        shapes=Vt.Vec4fArray([Gf.Vec4f(0.25, 0.75, 0, 1)]),
        shapeKinds=Vt.TokenArray(["triangle"]),
    )
    red, _ = read_appearances(open_stage(path))
    expected = Shape("triangle", (0.25, 0.75), (0, 1), 0.5, (1, 1, 1), 1, 0.5)
    assert red.transfer_2d.functions == {NAME: SHAPES, "sharp": (expected,)}
    assert red.chosen == "sharp"


def test_emptying_the_shapes_keeps_the_opacity_points(stage: Path, tmp_path: Path) -> None:
    empty = {"shapes": Vt.Vec4fArray(), "shapeKinds": Vt.TokenArray()}
    empty |= {"shapeTips": Vt.FloatArray(), "shapeSoftness": Vt.FloatArray()}
    path = edit(stage, tmp_path, **empty, shapeColors=Vt.Vec4fArray())
    red, _ = read_appearances(open_stage(path))
    assert red.transfer_2d.functions == {}
    assert NAME in red.transfer_functions


BOXES = Vt.Vec4fArray([Gf.Vec4f(0.2, 0.7, 0.1, 0.9), Gf.Vec4f(0.9, 0.1, 0, 1)])
MANY = Vt.Vec4fArray([Gf.Vec4f(0, 1, 0, 1)] * (MAX_SHAPES + 1))


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        (
            {"shapeKinds": Vt.TokenArray(["triangle"])},
            r"shapeKinds: found 1 entries, expected 2, one for each shape in stereocell:shapes",
        ),
        (
            {"shapeKinds": Vt.TokenArray(["triangle", "disc"])},
            "shapes: shape 1: kind is 'disc', expected one of rectangle, triangle",
        ),
        (
            {"shapes": BOXES},
            r"shapes: shape 1: values are \(0.9, 0.1\), expected them to rise within 0..1",
        ),
        ({"shapeTips": Vt.FloatArray([0.1, 7])}, "shapes: shape 1: tip is 7, expected 0..1"),
        ({"shapeTips": Vt.FloatArray([0.1])}, "shapeTips: found 1 entries, expected 2"),
        ({"shapeSoftness": Vt.FloatArray([0, 0, 0])}, "shapeSoftness: found 3 entries, expected 2"),
        (
            {"shapeColors": Vt.Vec4fArray([Gf.Vec4f(1, 1, 1, 3)] * 2)},
            "shapes: shape 0: opacity is 3, expected 0..1",
        ),
        (
            {"shapes": MANY, "shapeKinds": Vt.TokenArray(["triangle"] * len(MANY))},
            "shapes: found 33 shapes, expected at most 32",
        ),
        ({"gradientMax": 0.0}, "gradientMax is 0, expected a number above 0"),
        ({"gradientMax": float("nan")}, "gradientMax is nan, expected a number above 0"),
    ],
)
def test_the_error_for_a_faulty_edit_is_one_line(
    stage: Path, tmp_path: Path, arrays: dict[str, object], message: str
) -> None:
    path = edit(stage, tmp_path, **dict(arrays))
    with pytest.raises(StageError, match=rf"^{CD31}\.stereocell:{message}") as caught:
        read_appearances(open_stage(path))
    assert "\n" not in str(caught.value)


# The bundle


@pytest.fixture(scope="module")
def bundle(stage: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write the bundle of that stage; tests only read it."""
    out = tmp_path_factory.mktemp("bundle") / "bundle"
    write_bundle(stage, out, None, engine=Engine(0))
    return out


def functions(bundle: Path, name: str = "CD31") -> dict[str, object]:
    return dict(load(bundle / channel(bundle, name)["transfer_functions_2d"]["file"]["path"]))


def picture(bundle: Path) -> NDArray[np.uint8]:
    data = (bundle / functions(bundle)["histogram"]["path"]).read_bytes()  # type: ignore[index]
    assert np.frombuffer(data, "<u4", 3, 12).tolist() == [9, 1, COLUMNS]  # R8, bytes, width
    offset, length, _ = (int(n) for n in np.frombuffer(data, "<u8", 3, 80))
    texels = zstandard.decompress(data[offset : offset + length])
    return np.frombuffer(texels, np.uint8).reshape(ROWS, COLUMNS)


def test_the_bundle_has_the_shapes_and_its_files_match_their_schema(bundle: Path) -> None:
    schema = Draft202012Validator(
        json.loads(schema_path("transfer2d.schema.json").read_text("utf-8"))
    )
    for name in ("CD31", "Hoechst 33342"):
        schema.validate(functions(bundle, name))
    assert channel(bundle)["transfer_functions_2d"]["names"] == [NAME]
    found = functions(bundle)
    assert found["gradient_max"] == 0.37
    assert {name: shapes_from(s) for name, s in found["functions"].items()} == {NAME: SHAPES}
    blue = functions(bundle, "Hoechst 33342")
    assert blue["functions"] == {}
    assert channel(bundle, "Hoechst 33342")["transfer_functions_2d"]["names"] == []


def test_the_histogram_counts_the_volumes_of_all_tiles(bundle: Path) -> None:
    counts = sum(
        count_joint(t.channels[0].volume, spheres.SPACING, gradient_max=0.37) for t in TILES
    )
    assert isinstance(counts, np.ndarray)
    assert functions(bundle)["most"] == counts.max()
    assert np.array_equal(picture(bundle), log_scaled(counts))
    # Outside of the ball the field falls by 60 per um, which is 60 over two voxels of .5 um.
    row = round(60 / 255 / 0.37 * (ROWS - 1))
    middle = counts[:, 40:90].sum(axis=1)
    assert middle[row - 5 : row + 2].sum() > 0.8 * middle.sum()


def test_2d_functions_add_little_to_the_manifest(bundle: Path) -> None:
    """Shapes and histogram are separate files, and the manifest has one name per channel."""
    for name in ("CD31", "Hoechst 33342"):
        text = json.dumps(
            {"transfer_functions_2d": channel(bundle, name)["transfer_functions_2d"]}, indent=1
        )
        assert len(text) < 400


def test_an_edit_of_shapes_reaches_the_bundle(stage: Path, tmp_path: Path) -> None:
    path = edit(
        stage,
        tmp_path,
        shapes=Vt.Vec4fArray([Gf.Vec4f(0.1, 0.3, 0.2, 0.8)]),
        shapeKinds=Vt.TokenArray(["rectangle"]),
        shapeTips=Vt.FloatArray([0.2]),
        shapeColors=Vt.Vec4fArray([Gf.Vec4f(0, 1, 0, 0.6)]),
        shapeSoftness=Vt.FloatArray([0]),
        gradientMax=0.74,
    )
    write_bundle(path, tmp_path / "bundle", None, engine=Engine(0))
    entry = channel(tmp_path / "bundle")
    assert entry["transfer_function"] == NAME  # as chosen in the layer
    found = functions(tmp_path / "bundle")
    edited = Shape("rectangle", (0.1, 0.3), (0.2, 0.8), 0.2, (0, 1, 0), 0.6, 0)
    assert {name: shapes_from(s) for name, s in found["functions"].items()} == {NAME: (edited,)}
    assert found["gradient_max"] == 0.74
    counts = sum(
        count_joint(t.channels[0].volume, spheres.SPACING, gradient_max=0.74) for t in TILES
    )
    assert np.array_equal(picture(tmp_path / "bundle"), log_scaled(np.asarray(counts)))


# The whole way


def line_of(out: Path) -> CheckLine:
    """Return the errors of `check` about 2D functions."""
    return next(line for line in check(out) if line.name == "2D transfer functions")


@pytest.mark.slow
def test_a_build_suggests_the_boundary_or_gives_the_reason_for_none(
    tmp_path: Path,
) -> None:
    shape, spacing = (40, 48, 48), (0.5, 0.5, 0.5)
    center = tuple((n - 1) * h / 2 for n, h in zip(shape, spacing, strict=True))
    ball = as_counts(blurred_ball(shape, spacing, center, 7.0, 0.5), 300, 900)
    noisy = ball + np.random.default_rng(0).normal(0, 10, shape)
    flat = np.full(shape, 500, np.uint16)
    source = tmp_path / "two.ome.tif"
    write_ome_tiff(
        source, np.stack([noisy.astype(np.uint16), flat]), "CZYX", spacing, names=("Ball", "Flat")
    )
    out = tmp_path / "out"
    assert main(["plan", str(source), "-o", str(out)]) == 0
    for phase in ("units", "stage", "bundle"):
        assert main([phase, str(out), "--workers", "0"]) == 0
    ball, flat = read_survey(OutFolder(out)).values()
    appearance = ball.appearance
    (triangle,) = appearance.transfer_2d.functions[NAME]
    low, high = appearance.window
    # Half-way between the ball's and the background's counts
    assert low + triangle.tip * (high - low) == pytest.approx(600, abs=20)
    assert flat.appearance.transfer_2d.functions == {}
    assert flat.statistics.suggested.reason == "materials found: 1, expected at least 2"
    red = functions(out / "bundle", "Ball")
    assert [s["kind"] for s in red["functions"][NAME]] == ["triangle"]  # type: ignore[index]
    assert functions(out / "bundle", "Flat")["functions"] == {}
    assert line_of(out) == CheckLine("2D transfer functions", True, "1 shapes")

    file = out / "bundle" / channel(out / "bundle", "Ball")["transfer_functions_2d"]["file"]["path"]
    content = load(file)
    content["functions"][NAME][0]["values"].reverse()
    file.write_text(json.dumps(content))
    assert "arcs: shape 0: values are" in line_of(out).detail
    content["functions"]["other"] = content["functions"].pop(NAME)
    file.write_text(json.dumps(content))
    assert "found functions other, expected arcs as in the manifest" in line_of(out).detail
