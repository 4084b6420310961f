"""The bundle of a PET series opens as a heat map."""

import json
from pathlib import Path

from stereocell.cli.__main__ import main
from support.pet_series import write_pet


def test_a_pet_series_opens_as_a_heat_map_in_activity(tmp_path: Path) -> None:
    write_pet(tmp_path / "in", 20)
    out = tmp_path / "out"
    assert main(["build", str(tmp_path / "in"), "-o", str(out)]) == 0
    (channel,) = json.loads((out / "bundle" / "manifest.json").read_text("utf-8"))["channels"]
    assert (channel["name"], channel["transfer_function"]) == ("PT", "heat")
    assert 900 < channel["window"][1] < 1100  # Bq/ml; the scene's values are 1000 and 20
    assert "Units BQML" in (out / "provenance.json").read_text("utf-8")
