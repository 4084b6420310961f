"""Layers in README and docs state the units and the root prim of the stage below them."""

import re
from pathlib import Path

import pytest
from pxr import Sdf, Usd, UsdGeom

from support.bundles import write_tiles

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
EXAMPLES = [
    pytest.param(text, id=f"{page.name}-{number}")
    for page in PAGES
    for number, text in enumerate(
        re.findall(r"```usda\n(.*?)```", page.read_text("utf-8"), re.DOTALL)
    )
]


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Path(write_tiles(tmp_path_factory.mktemp("stage")))


def test_the_page_on_blender_has_a_layer() -> None:
    assert any(one.id == "blender.md-0" for one in EXAMPLES)


@pytest.mark.parametrize("text", EXAMPLES)
def test_a_layer_of_the_docs_composes_over_a_stage_with_its_units(
    stage: Path, tmp_path: Path, text: str
) -> None:
    path = tmp_path / "edited.usda"
    path.write_text(text.replace("out/mine/stage/stage.usda", str(stage)))
    layer = Sdf.Layer.FindOrOpen(str(path))
    assert layer.defaultPrim == "Specimen"
    for key in ("metersPerUnit", "upAxis"):
        assert layer.pseudoRoot.HasInfo(key), key
    over = Usd.Stage.Open(layer)
    assert UsdGeom.GetStageMetersPerUnit(over) == 1e-6
    assert UsdGeom.GetStageUpAxis(over) == "Y"
    # Some programs can\'t read exponents.
    assert "metersPerUnit = 0.000001\n" in text
    assert over.GetDefaultPrim().IsValid()
    changed = [spec.path for spec in layer.rootPrims["Specimen"].nameChildren]
    assert changed
    assert all(over.GetPrimAtPath(place) for place in changed)
