from itertools import product
from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdValidation

from stereocell.formats.vdb import write_vdb
from stereocell.usd.validate import validate_stage
from support.stages import F_ID, FUNCTIONS, HEAD, TILES, leaf, write_whole


@pytest.fixture(scope="module")
def stage_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_whole(tmp_path_factory.mktemp("stage"))


def test_every_validator_of_usd_runs_clean(stage_path: Path) -> None:
    assert len(UsdValidation.ValidationRegistry().GetOrLoadAllValidators()) >= 25
    assert validate_stage(stage_path) == []


FAULTS = {
    "indices from 0 to 99999": "int[] faceVertexIndices = [0, 1, 99999]\n"
    "int[] faceVertexCounts = [3]",
    "2 indices, expected 3": "int[] faceVertexIndices = [0, 1]\nint[] faceVertexCounts = [3]",
    "1 normals, expected": "normal3f[] normals = [(0, 0, 1)]",
    "found normals on the back of most faces": 'uniform token orientation = "leftHanded"',
    "extent is": "float3[] extent = [(0, 0, 0), (1, 1, 1)]",
    "primvar st has 1 values": 'texCoord2f[] primvars:st = [(0, 0)] (interpolation = "vertex")',
    "not finite": "point3f[] points = [(0, 0, nan)]",
}


@pytest.mark.parametrize("expected", FAULTS)
def test_a_faulty_mesh_is_found(stage_path: Path, tmp_path: Path, expected: str) -> None:
    mesh = f'over "{F_ID}_r0_c0"\n{{\n{FAULTS[expected]}\n}}'
    findings = validate_edit(
        stage_path, tmp_path, f'over "r0_c0"\n{{\nover "{F_ID}"\n{{\n{mesh}\n}}\n}}'
    )
    assert any(expected in text and leaf("r0_c0", F_ID) in text for text in findings)


def test_an_unknown_variant_is_found(stage_path: Path, tmp_path: Path) -> None:
    findings = validate_edit(
        stage_path, tmp_path, 'over "r0_c0" (variants = {\nstring lod = "lod9"\n})\n{\n}'
    )
    assert any("variant set lod selects 'lod9'" in text for text in findings)


def test_window_with_reversed_bounds_is_found(stage_path: Path, tmp_path: Path) -> None:
    path = tmp_path / "edit.usda"
    window = f'over "{F_ID}"\n{{\nfloat2 stereocell:window = (9, 2)\n}}'
    body = f'over "Specimen"\n{{\nover "Channels"\n{{\n{window}\n}}\n}}\n'
    path.write_text(f"{HEAD}subLayers = [@{stage_path}@])\n{body}")
    findings = [str(finding) for finding in validate_stage(path)]
    words = "window is (9, 2), expected the first number below the second (look)"
    expected = f"/Specimen/Channels/{F_ID}: {words}"
    assert expected in findings


def test_bounds_that_do_not_hold_the_tile_are_found(stage_path: Path, tmp_path: Path) -> None:
    hint = "float3[] extentsHint = [(0, 0, 0), (1, 1, 1)]"
    findings = validate_edit(stage_path, tmp_path, f'over "r0_c1"\n{{\n{hint}\n}}')
    assert any("extentsHint" in text and "expected a box round" in text for text in findings)


def test_units_that_differ_between_layers_are_found(stage_path: Path, tmp_path: Path) -> None:
    findings = validate_edit(stage_path, tmp_path, "", head=HEAD.replace("1e-6", "0.01"))
    assert any("edit.usda: metersPerUnit is 0.01, expected 1e-06" in text for text in findings)
    findings = validate_edit(stage_path, tmp_path, "", head="#usda 1.0\n(")
    assert any("upAxis is None, expected Y" in text for text in findings)
    assert any("defaultPrim is ''" in text for text in findings)


def validate_edit(stage_path: Path, folder: Path, tiles: str, head: str = HEAD) -> list[str]:
    body = f'over "Specimen"\n{{\nover "Tiles"\n{{\n{tiles}\n}}\n}}\n'
    path = folder / "edit.usda"
    path.write_text(f"{head}subLayers = [@{stage_path}@])\n{body}")
    Sdf.Layer.FindOrOpen(str(path)).Reload()
    return [str(finding) for finding in validate_stage(path)]


def test_faults_of_unselected_levels_and_missing_files_are_found(tmp_path: Path) -> None:
    path = write_whole(tmp_path)
    file = tmp_path / "tiles" / "r0_c0" / "tile.usdc"
    tile = Usd.Stage.Open(str(file))
    lods = tile.GetDefaultPrim().GetVariantSets().GetVariantSet("lod")
    lods.SetVariantSelection("lod2")
    with lods.GetVariantEditContext():
        mesh = UsdGeom.Mesh.Get(tile, f"/r0_c0/{F_ID}/{F_ID}_r0_c0")
        mesh.GetNormalsAttr().Set([(0, 0, 1)])
    lods.SetVariantSelection("lod1")
    tile.Save()
    missing = [
        tmp_path / "tiles" / "r0_c1" / f"{F_ID}{end}" for end in (".vdb", "_lod2_normal.png")
    ]
    missing.append(tmp_path / "looks" / f"{F_ID}_soft.exr")
    for name in missing:
        name.unlink()
    findings = [str(finding) for finding in validate_stage(path)]
    assert any("(lod=lod2): found 1 normals" in text for text in findings)
    assert not any("(lod=lod1)" in text for text in findings)
    for name in missing:
        assert any(str(name) in text for text in findings)


def test_file_that_is_not_a_stage_is_one_finding(tmp_path: Path) -> None:
    (tmp_path / "stage.usda").write_text("#usda 1.0\nnonsense")
    for path in (tmp_path / "stage.usda", tmp_path / "missing.usda"):
        (finding,) = validate_stage(path)
        assert path.name in str(finding)


def test_every_combination_of_variants_composes(stage_path: Path) -> None:
    stage = Usd.Stage.Open(str(stage_path))
    tiles = [stage.GetPrimAtPath(f"/Specimen/Tiles/{tile}") for tile in TILES]
    channel = stage.GetPrimAtPath(f"/Specimen/Channels/{F_ID}")
    lods, representations = (
        tiles[0].GetVariantSet(name).GetVariantNames() for name in ("lod", "representation")
    )
    assert (len(lods), len(representations)) == (3, 3)
    for lod, representation, function in product(lods, representations, FUNCTIONS):
        for tile in tiles:
            assert tile.GetVariantSet("lod").SetVariantSelection(lod)
            assert tile.GetVariantSet("representation").SetVariantSelection(representation)
        assert channel.GetVariantSet("transferFunction").SetVariantSelection(function)
        assert not stage.GetCompositionErrors()
        drawn = {prim.GetName(): prim.GetTypeName() for prim in stage.Traverse()}
        for tile in TILES:
            shown = {"Mesh": f"{F_ID}_{tile}", "Volume": f"{F_ID}_{tile}_volume"}
            for kind, name in shown.items():
                # A hidden representation is inactive, so programs don't find it.
                expected = representation in ("both", kind.lower())
                assert (drawn.get(name) == kind) == expected
        assert np.allclose(
            channel.GetAttribute("stereocell:opacityPoints").Get(), FUNCTIONS[function]
        )


def edit_volume(stage_path: Path, folder: Path, content: str) -> list[str]:
    field = f'over "{F_ID}_r0_c0_volume"\n{{\n{content}\n}}'
    return validate_edit(
        stage_path, folder, f'over "r0_c0"\n{{\nover "{F_ID}"\n{{\n{field}\n}}\n}}'
    )


def test_a_field_that_its_vdb_lacks_is_found(stage_path: Path, tmp_path: Path) -> None:
    field = 'over "density"\n{\ntoken fieldName = "temperature"\n}'
    (text,) = edit_volume(stage_path, tmp_path, field)
    assert text.startswith(leaf("r0_c0", F_ID, "_volume") + "/density")
    assert "fieldName is 'temperature', expected one of ['density']" in text


def test_a_vdb_in_metres_is_found(stage_path: Path, tmp_path: Path) -> None:
    voxels = np.full((16, 48, 18), 9, np.uint8)
    write_vdb(
        tmp_path / "metres.vdb", voxels, first_um=(0, 0, 0), spacing_um=(0.5e-6, 0.25e-6, 0.25e-6)
    )
    field = 'over "density"\n{\nasset filePath = @./metres.vdb@\n}'
    (text,) = edit_volume(stage_path, tmp_path, field)
    assert "voxels of [2.5e-07, 2.5e-07, 5e-07]" in text
    assert "expected [0.25, 0.25, 0.5]" in text


def test_a_volume_of_two_files_is_found(stage_path: Path, tmp_path: Path) -> None:
    path = leaf("r0_c0", F_ID, "_volume") + "/density"
    findings = edit_volume(stage_path, tmp_path, f"rel field:second = <{path}>")
    assert not any("expected 1, since programs read only one" in text for text in findings)
    path = leaf("r0_c1", F_ID, "_volume") + "/density"
    findings = edit_volume(stage_path, tmp_path, f"rel field:second = <{path}>")
    assert any(
        "fields name 2 VDB files, expected 1, since programs read only one" in text
        for text in findings
    )


def test_two_things_of_one_name_are_found(stage_path: Path, tmp_path: Path) -> None:
    twin = f'over "r0_c0"\n{{\ndef Sphere "{F_ID}_r0_c1"\n{{\n}}\n}}'
    findings = validate_edit(stage_path, tmp_path, twin)
    words = f"found 2 prims with the name {F_ID}_r0_c1, expected 1"
    named = [text for text in findings if words in text]
    assert {text.split(": ")[0].split(" ")[0] for text in named} == {
        f"/Specimen/Tiles/r0_c0/{F_ID}_r0_c1",
        leaf("r0_c1", F_ID),
    }


def test_a_selection_in_a_set_that_is_not_there_is_found(stage_path: Path, tmp_path: Path) -> None:
    selected = 'over "r0_c0" (variants = {\nstring level = "lod0"\n})\n{\n}'
    findings = validate_edit(stage_path, tmp_path, selected)
    assert any("variant set level selects 'lod0', expected one of []" in text for text in findings)


def test_units_of_a_layer_in_an_unselected_variant_are_found(
    stage_path: Path, tmp_path: Path
) -> None:
    (tmp_path / "cm.usda").write_text('#usda 1.0\n(defaultPrim = "A")\ndef "A"\n{\n}\n')
    hidden = 'over "extra" (references = @./cm.usda@)\n{\n}'
    variant = f'variantSet "lod" = {{\n"lod2" {{\n{hidden}\n}}\n}}'
    tiles = f'over "r0_c0" (prepend variantSets = "lod")\n{{\n{variant}\n}}'
    findings = validate_edit(stage_path, tmp_path, tiles)
    assert any("cm.usda: metersPerUnit is None, expected 1e-06" in text for text in findings)
