"""The window for transfer functions writes curves and gradients to a layer for `bundle`."""

import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pxr import Sdf

from stereocell.formats.ktx2 import decode_finest
from stereocell.transfer.opacity import evaluate
from support.bundles import channel, load, write
from support.unity_import import texels_of

Run = Callable[..., subprocess.CompletedProcess[bytes]]


def rows() -> list[list[int]]:
    """Return rows of opacities for 256 intensities: constants, ramps, steps, smooth, and noise."""
    x = np.linspace(0, 1, 256)
    steps = np.where((x > 0.3) & (x < 0.6), 200, 10)
    smooth = 255 * np.exp(-(((x - 0.5) / 0.2) ** 2))
    noise = np.random.default_rng(6).integers(0, 256, 256)
    points = [(0.0, 0.0), (0.2, 0.02), (0.55, 0.6), (1.0, 0.9)]
    ramps = 255 * evaluate(tuple(points), size=256)
    each = [np.zeros(256), np.full(256, 255), 255 * x, ramps, steps, smooth, noise]
    return [[int(value) for value in np.rint(row)] for row in each]


def test_functions_survive_points_curves_and_gradients(run: Run) -> None:
    done = run("points", data=json.dumps(rows()).encode())
    assert done.returncode == 0, done.stderr.decode()
    sizes = []
    for row, found in zip(rows(), json.loads(done.stdout), strict=True):
        points = found["points"]
        sizes.append(len(points))
        # A line through bytes is off by at most one step.
        assert np.abs(np.subtract(found["row"], row)).max() <= 1
        assert np.abs(np.subtract(found["curve"], found["row"])).max() == 0
        assert found["keys"] == min(len(points), 8)
        if len(points) <= 8:
            assert found["gradient"] == found["row"]
        # The pipeline evaluates the same points to nearly the same bytes.
        again = np.rint(255 * evaluate(tuple(map(tuple, points)), size=256))
        assert np.abs(again - found["row"]).max() <= 1
        assert (again != found["row"]).mean() < 0.02
    assert sizes[:3] == [2, 2, 2]
    assert sizes[3] <= 5  # four points; the one at 0.55 lies between two of the 256 intensities
    assert sizes[4] == 6  # a step takes two points
    assert sizes[5] < 30


def edited(run: Run, bundle: Path, stage: Path, layer: Path, *frames: dict[str, Any]) -> Any:
    done = run("layer", bundle, stage, layer, json.dumps(frames))
    assert done.returncode == 0, done.stderr.decode()
    return json.loads(done.stdout)


POINTS = [[0, 0], [0.25, 0.1], [0.5, 0.75], [1, 0.2]]


def row_of(points: list[list[float]]) -> NDArray[np.float32]:
    """Return the opacities for 256 intensities, 0..255; a stage's numbers are 32-bit floats."""
    exact = tuple((float(np.float32(x)), float(np.float32(y))) for x, y in points)
    row: NDArray[np.float32] = np.rint(255 * evaluate(exact, size=256))
    return row


@pytest.mark.slow
def test_edits_of_the_window_reach_a_new_bundle(
    run: Run, bundle: Path, stage: Path, tmp_path: Path
) -> None:
    layer = tmp_path / "from_unity.usda"
    # The stub changes the first field with a label, which belongs to the first channel, CD31.
    name = load(bundle / "manifest.json")["channels"][0]["name"]
    assert name == "CD31"
    found = edited(
        run, bundle, stage, layer,
        {"field": "Opacity", "points": POINTS},
        {"field": "Colour and opacity", "colors": [[0.5, 1.0, 0.0]]},
        {"field": "CD31", "value": False},
    )  # fmt: skip
    assert str(layer) in found["message"]
    function = channel(bundle)["transfer_function"]
    expected = row_of(POINTS)
    row = channel(bundle)["transfer_functions"].index(function)
    # The scene shows the edit, and the imported table is unchanged.
    shown = texels_of(found["shown"])[0, row, :, 3].astype(int)
    assert np.abs(shown - expected).max() <= 1  # rounding may differ by one
    assert (shown != expected).mean() < 0.05
    before = decode_finest((bundle / channel(bundle)["lut"]["path"]).read_bytes())[0]
    assert np.array_equal(texels_of(found["imported"])[0, row], before[row])

    out = tmp_path / "out"
    lines = write(layer, out)
    assert not [line for line in lines if "not taken over" in line]
    after = channel(out)
    lut = decode_finest((out / after["lut"]["path"]).read_bytes())[0]
    assert np.array_equal(lut[row, :, 3], expected)
    assert after["color"] == pytest.approx([0.21404114, 1, 0], abs=1e-6)
    assert after["opens"] is False
    # The edit leaves the other functions and channels unchanged.
    others = [i for i in range(len(before)) if i != row]
    assert np.array_equal(lut[others], before[others])
    blue = load(bundle / "manifest.json")["channels"][1]["name"]
    assert channel(out, blue)["color"] == channel(bundle, blue)["color"]
    assert channel(out, blue).get("opens", True)


@pytest.mark.slow
def test_a_chosen_function_is_written_and_unedited_values_are_not(
    run: Run, bundle: Path, stage: Path, tmp_path: Path
) -> None:
    layer = tmp_path / "chosen.usda"
    functions = channel(bundle)["transfer_functions"]
    other = next(f for f in functions if f != channel(bundle)["transfer_function"])
    edited(run, bundle, stage, layer, {"field": "Function", "value": functions.index(other)})
    written = Sdf.Layer.FindOrOpen(str(layer))
    assert not written.GetPrimAtPath("/Specimen/Channels/CD31").attributes
    assert not written.GetPrimAtPath("/Specimen/Shown")
    assert [prim.name for prim in written.GetPrimAtPath("/Specimen/Channels").nameChildren] == [
        "CD31"
    ]
    write(layer, tmp_path / "out")
    assert channel(tmp_path / "out")["transfer_function"] == other
    before = decode_finest((bundle / channel(bundle)["lut"]["path"]).read_bytes())
    after = channel(tmp_path / "out")["lut"]["path"]
    assert np.array_equal(decode_finest((tmp_path / "out" / after).read_bytes()), before)


def test_no_layer_is_written_without_edits_or_over_the_stage(
    run: Run, bundle: Path, stage: Path, tmp_path: Path
) -> None:
    layer = tmp_path / "none.usda"
    assert "Nothing was edited" in edited(run, bundle, stage, layer)["message"]
    assert not layer.exists()
    before = stage.read_bytes()
    message = edited(run, bundle, stage, stage, {"field": "CD31", "value": False})["message"]
    assert "is the stage itself" in message
    assert stage.read_bytes() == before


def test_a_gradient_of_several_colours_is_refused_in_the_window(
    run: Run, bundle: Path, stage: Path, tmp_path: Path
) -> None:
    layer = tmp_path / "rainbow.usda"
    colors = [[1, 0, 0], [0, 0, 1]]
    found = edited(run, bundle, stage, layer, {"field": "Colour and opacity", "colors": colors})
    (line,) = (line for line in found["drawn"] if "several colours" in line)
    assert line.startswith("CD31: found several colours, expected one")
    assert "Nothing was edited" in found["message"]


@pytest.mark.slow
def test_a_new_colour_keeps_a_function_of_many_points(
    run: Run, bundle: Path, stage: Path, tmp_path: Path
) -> None:
    """A gradient has at most eight keys, so it only approximates a function with more points."""
    layer = tmp_path / "many.usda"
    points = [[i / 11, (i * 7 % 12) / 12] for i in range(12)]
    edited(
        run, bundle, stage, layer,
        {"field": "Opacity", "points": points},
        {"field": "Colour and opacity", "colors": [[0.0, 1.0, 0.0]]},
    )  # fmt: skip
    write(layer, tmp_path / "out")
    made = channel(tmp_path / "out")
    lut = decode_finest((tmp_path / "out" / made["lut"]["path"]).read_bytes())[0]
    row = made["transfer_functions"].index(made["transfer_function"])
    assert np.array_equal(lut[row, :, 3], row_of(points))
    assert made["color"] == pytest.approx([0, 1, 0], abs=1e-6)
