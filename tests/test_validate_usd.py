from pathlib import Path

import pytest
from pxr import Sdf, Usd, UsdGeom, UsdValidation

from stages import F_ID, HEAD, leaf, write_whole
from stereocell.validate_usd import validate_stage


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
    "normals point against most faces": 'uniform token orientation = "leftHanded"',
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


def test_a_window_that_falls_is_found(stage_path: Path, tmp_path: Path) -> None:
    path = tmp_path / "edit.usda"
    window = f'over "{F_ID}"\n{{\nfloat2 stereocell:window = (9, 2)\n}}'
    body = f'over "Specimen"\n{{\nover "Channels"\n{{\n{window}\n}}\n}}\n'
    path.write_text(f"{HEAD}subLayers = [@{stage_path}@])\n{body}")
    findings = [str(finding) for finding in validate_stage(path)]
    expected = f"/Specimen/Channels/{F_ID}: window is (9, 2), expected it to rise (look)"
    assert expected in findings


def test_bounds_that_do_not_hold_the_tile_are_found(stage_path: Path, tmp_path: Path) -> None:
    hint = "float3[] extentsHint = [(0, 0, 0), (1, 1, 1)]"
    findings = validate_edit(stage_path, tmp_path, f'over "r0_c1"\n{{\n{hint}\n}}')
    assert any("extentsHint" in text and "does not hold" in text for text in findings)


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
    assert any("(lod=lod2): 1 normals" in text for text in findings)
    assert not any("(lod=lod1)" in text for text in findings)
    for name in missing:
        assert any(str(name) in text for text in findings)


def test_what_is_no_stage_is_one_finding(tmp_path: Path) -> None:
    (tmp_path / "stage.usda").write_text("#usda 1.0\nnonsense")
    for path in (tmp_path / "stage.usda", tmp_path / "missing.usda"):
        (finding,) = validate_stage(path)
        assert path.name in str(finding)
