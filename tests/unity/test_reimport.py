"""A changed bundle is imported again, and the rest of the project stays as it is.

The stub of Unity's asset database imports in the cases that Unity's documentation states. It fails
if an import writes into the project.
"""

import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from pxr import Gf, Sdf, Usd

from stereocell.engine.run import Engine
from support.bundles import CD31, load, write_bundle
from support.unity_import import boxes

Run = Callable[..., subprocess.CompletedProcess[bytes]]
Import = Callable[..., Any]


@pytest.fixture(scope="module")
def rebuilt(stage: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the bundle, built again after an edit of its first channel's colour."""
    folder = tmp_path_factory.mktemp("rebuilt")
    layer = Sdf.Layer.CreateNew(str(folder / "green.usda"))
    layer.subLayerPaths = [str(stage)]
    over = Usd.Stage.Open(layer)
    over.GetPrimAtPath(CD31).GetAttribute("inputs:color").Set(Gf.Vec3f(0, 1, 0))
    layer.Save()
    write_bundle(Path(layer.realPath), folder / "bundle", None, engine=Engine(0))
    return folder / "bundle"


@pytest.mark.slow
@pytest.mark.parametrize("how", ["link", "copy"])
def test_a_changed_bundle_is_imported_again_and_nothing_of_the_project_is_lost(
    run: Run, bundle: Path, rebuilt: Path, how: str
) -> None:
    done = run("changes", bundle, rebuilt, how)
    assert done.returncode == 0, done.stderr.decode()
    first, same, changed, damaged = json.loads(done.stdout)
    assert first["errors"] == same["errors"] == changed["errors"] == []
    assert same["imports"] == 0  # coming back to the editor imports nothing
    assert changed["imports"] == 1
    # Overrides and references use these names, so they must not change.
    assert first["objects"] == changed["objects"]
    assert first["paths"] == changed["paths"]
    assert len(set(first["paths"])) == len(first["paths"])
    # The bundle's new colour is imported, and the project's own material is kept.
    assert changed["color"] != first["color"]
    assert changed["color"][:3] == pytest.approx([0, 1, 0], abs=1e-6)
    assert first["materials"] == changed["materials"] == ["my own"]
    assert not any(name.startswith("material CD31") for name in first["objects"])
    # The asset's import log reports the damaged bundle.
    (error,) = damaged["errors"]
    assert error.startswith("Assets/Mine.stereocell: ")
    assert "\n" not in error
    assert all(day["files"] == ["Assets/Mine.stereocell"] for day in (first, changed, damaged))


@pytest.mark.slow
def test_parts_of_the_asset_are_named_after_the_bundle(bundle: Path, imported: Import) -> None:
    found = imported(bundle)
    names = found["objects"]
    assert "specimen" in names
    assert "transfer functions" in names
    surfaces = [f"mesh CD31 {t} lod{k}" for t in ("r0_c0", "r0_c1") for k in range(3)]
    volumes = [f"volume {part} {t}" for part in ("box", "material") for t in ("r0_c0", "r0_c1")]
    materials = [name for name in names if name.startswith("material ")]
    assert set(names) == {"specimen", "transfer functions", *surfaces, *volumes, *materials}
    assert "material CD31" in materials
    assert len(materials) < len(surfaces)  # equal materials are shared
    assert [Path(path).name for path in found["sources"]] == ["StereoCellVolume.shader"]


@pytest.mark.slow
def test_a_copy_is_imported_like_a_link(bundle: Path, imported: Import) -> None:
    linked, copied = imported(bundle), imported(bundle, copy=True)
    assert copied["objects"] == linked["objects"]
    volumes = [
        [box["material"]["_Volume"]["texels"] for _, box in boxes(each["root"])]
        for each in (linked, copied)
    ]
    assert volumes[0] == volumes[1]


@pytest.mark.slow
def test_a_voxel_file_is_named_after_its_content(bundle: Path, imported: Import) -> None:
    def files(found: Any) -> list[str]:
        return [box["file"] for _, box in boxes(found["root"])]

    fine, again, coarse = imported(bundle), imported(bundle), imported(bundle, mostTexels=12)
    assert files(fine) == files(again)
    assert not set(files(fine)) & set(files(coarse))


@pytest.mark.slow
def test_a_player_contains_the_voxels_of_its_scenes(run: Run, bundle: Path) -> None:
    done = run("build", bundle)
    assert done.returncode == 0, done.stderr.decode()
    found = json.loads(done.stdout)
    assert len(found["boxes"]) == len(load(bundle / "manifest.json")["tiles"])
    assert found["Assets/a.unity"] == sorted(f"StereoCell/{file}" for file in found["boxes"])
    assert found["Assets/b.unity"] == []


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("{}", 'expected {"bundle"'),
        ("nothing", "expected a zip file of a bundle, or"),
        ('{"bundle": "nowhere"}', "manifest.json is missing in"),
        ("PK nothing", "damaged zip file"),
    ],
)
def test_an_asset_that_is_not_a_bundle_is_refused_in_one_line(
    run: Run, tmp_path: Path, text: str, expected: str
) -> None:
    (tmp_path / "Assets").mkdir()
    (tmp_path / "Assets" / "x.stereocell").write_text(text)
    done = run("asset", "Assets/x.stereocell", project=tmp_path)
    assert done.returncode == 0, done.stderr.decode()
    (error,) = json.loads(done.stdout)
    assert expected in error
    assert "\n" not in error
