"""The colours of an OME-TIFF's channels reach the plan and the stage."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from pxr import Usd

from stereocell.cli.__main__ import main
from stereocell.model.emission_color import color_of_light
from stereocell.planning.channels import PALETTE
from stereocell.usd.layer import CHANNELS

Color = tuple[float, ...]
BLUE, RED, GREEN = (color_of_light(nm) for nm in (461, 610, 519))
CASES: dict[str, tuple[dict[str, Any], tuple[Any, Any]]] = {
    "wavelengths": (
        {"EmissionWavelength": [610.0, 461.0], "EmissionWavelengthUnit": ["nm", "nm"]},
        (RED, BLUE),
    ),
    "dyes": ({"Fluor": ["Alexa Fluor 488", "DAPI"]}, (GREEN, BLUE)),
    "names of dyes": ({"Name": ["AF488", "Hoechst"]}, (GREEN, BLUE)),
    "a wavelength before another dye": (
        {
            "Fluor": ["DAPI", "DAPI"],
            "EmissionWavelength": [610.0, 461.0],
            "EmissionWavelengthUnit": ["nm", "nm"],
        },
        (RED, BLUE),
    ),
    "neither": ({}, PALETTE[:2]),
}


@pytest.mark.parametrize("name", CASES)
def test_channel_has_the_colour_of_its_emission_in_plan_and_stage(
    tmp_path: Path, name: str
) -> None:
    stated, expected = CASES[name]
    names = ["a", "b"]
    z, y, x = np.indices((8, 20, 20))
    ball = ((z - 4) * 2) ** 2 + (y - 10) ** 2 + (x - 10) ** 2 < 36
    voxels = np.stack([100 + 2000 * ball, 100 + 1500 * ball], axis=1).astype(np.uint16)
    spacing = {"PhysicalSizeZ": 1.0, "PhysicalSizeY": 0.5, "PhysicalSizeX": 0.5}
    metadata = {"axes": "ZCYX", "Channel": {"Name": names, **stated}, **spacing}
    tifffile.imwrite(tmp_path / "cells.ome.tif", voxels, ome=True, metadata=metadata)
    out = tmp_path / "out"
    surfaces = [f"--surfaces={place}=none" for place in (0, 1)]
    assert main(["plan", str(tmp_path / "cells.ome.tif"), "-o", str(out), *surfaces]) == 0
    for phase in ("units", "stage"):
        assert main([phase, str(out), "--workers", "0"]) == 0
    planned = json.loads((out / "plan.json").read_text(encoding="utf-8"))["channels"]
    assert [channel["color"] for channel in planned] == [pytest.approx(one) for one in expected]
    stage = Usd.Stage.Open(str(out / "stage" / "stage.usda"))
    shown = stage.GetPrimAtPath(CHANNELS).GetChildren()
    colors = [tuple(prim.GetAttribute("inputs:color").Get()) for prim in shown]
    assert colors == [pytest.approx(one, abs=1e-6) for one in expected]
