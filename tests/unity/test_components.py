"""The Unity package's components: channels, the order of blending, the Inspector and the gaze."""

import json
import subprocess
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stereocell.formats.ktx2 import decode_finest
from support.bundles import load
from support.unity_import import boxes, child, texels_of

Run = Callable[..., subprocess.CompletedProcess[bytes]]
Import = Callable[..., Any]


@pytest.mark.slow
def test_transfer_functions_are_rows_of_one_table(bundle: Path, imported: Import) -> None:
    found = imported(bundle)
    channels = load(bundle / "manifest.json")["channels"]
    rows = [decode_finest((bundle / c["lut"]["path"]).read_bytes())[0] for c in channels]
    table = found["table"]
    assert np.array_equal(texels_of(table)[0], np.concatenate(rows))
    assert table["linear"]
    assert table["wrap"] == "Clamp"
    for c, channel in enumerate(channels):
        made = found["channels"][c]
        assert made["name"] == channel["name"]
        assert made["functions"][made["function"]] == channel["transfer_function"]
    for _, box in boxes(found["root"]):
        for place, c in enumerate(box["channels"]):
            made, block = found["channels"][c], box["material"]
            row = made["firstRow"] + made["function"] + 0.5
            assert block["_Rows"][place] == pytest.approx(row / table["size"][1])
            color = block[f"_Color{place}"][:3]
            assert color == pytest.approx(channels[c]["color"], abs=1e-6)
            assert block["_Shown"][place] == 1
        assert block["_Shown"][len(box["channels"]) :] == [0] * (4 - len(box["channels"]))
        assert block["_Steps"] == 100


CALLS = [
    {"name": "SetVisible", "args": ["Hoechst 33342", False]},
    {"name": "SetFunction", "args": ["CD31", "sharp"]},
    {"name": "SetColor", "args": ["CD31", [0.5, 1.0, 0.0]]},
    {"name": "endsAtSurfaces", "args": []},
]


@pytest.mark.slow
@pytest.mark.parametrize("plays", [False, True])
def test_channels_are_shown_coloured_and_classified_by_name(
    bundle: Path, imported: Import, plays: bool
) -> None:
    found = imported(bundle, calls=CALLS, camera=True, **({"play": True} if plays else {}))
    by_id = {c["id"]: i for i, c in enumerate(found["channels"])}
    red = by_id["CD31"]
    for _, box in boxes(found["root"]):
        place = box["channels"].index(red)
        row = (
            found["channels"][red]["functions"].index("sharp") + found["channels"][red]["firstRow"]
        )
        material = box["material"]
        assert material["_Rows"][place] == pytest.approx((row + 0.5) / found["table"]["size"][1])
        assert material[f"_Color{place}"] == pytest.approx([0.21404114, 1, 0, 1])
        assert material["_Shown"][1 - place] == 0
        assert box["enabled"]
        # A material holds the values that the state of the pass needs. Only play mode has one.
        assert material.get("_ZTest") == (8 if plays else None)
        assert material.get("_SceneDepth") == (1 if plays else None)
    assert found["depth"] == "Depth"
    for tile in found["root"]["children"]:
        for level in child(tile, "surfaces", "CD31")["children"]:
            values = level["material"] if plays else level["block"]
            assert values["baseColorFactor"] == pytest.approx([0.5, 1, 0, 1], abs=1e-5)
            assert level["enabled"]


@pytest.mark.slow
def test_a_player_has_no_property_blocks_which_would_break_batches(
    bundle: Path, imported: Import
) -> None:
    """The scriptable pipelines batch only renderers without property blocks."""

    def blocks(made: Any) -> list[str]:
        own = [made["name"]] if "block" in made else []
        return own + [name for each in made.get("children", []) for name in blocks(each)]

    assert blocks(imported(bundle, calls=CALLS, camera=True, play=True)["root"]) == []
    assert len(blocks(imported(bundle, calls=CALLS, camera=True)["root"])) > 4


@pytest.mark.slow
def test_hidden_channels_hide_their_surfaces_and_empty_boxes(
    bundle: Path, imported: Import
) -> None:
    names = [c["name"] for c in load(bundle / "manifest.json")["channels"]]
    calls = [{"name": "SetVisible", "args": [name, False]} for name in names]
    found = imported(bundle, calls=calls)
    assert not any(box["enabled"] for _, box in boxes(found["root"]))
    for tile in found["root"]["children"]:
        for level in child(tile, "surfaces", "CD31")["children"]:
            assert not level["enabled"]
            assert "block" not in level  # the imported material is unchanged


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ({"name": "SetVisible", "args": ["CD8", True]}, "the specimen has no channel CD8"),
        ({"name": "SetFunction", "args": ["CD31", "x"]}, "CD31 has no transfer function x"),
    ],
)
def test_an_unknown_name_is_shown(bundle: Path, imported: Import, call: Any, message: str) -> None:
    assert imported(bundle, calls=[call]) == message


def test_volumes_are_blended_from_the_farthest_along_every_ray(run: Run) -> None:
    """A grid of boxes of different sizes, seen from outside and from inside."""
    edges = ([0, 4, 10, 13], [-7, -2, 0], [0, 3, 5])
    x, y, z = ([*pairwise(along)] for along in edges)
    grid = [[[a[0], b[0], c[0]], [a[1], b[1], c[1]]] for a in x for b in y for c in z]
    rng = np.random.default_rng(2)
    eyes = rng.uniform([-12, -18, -10], [28, 12, 20], (150, 3))
    orders = json.loads(run("sort", json.dumps(grid), json.dumps(eyes.tolist())).stdout)
    low, high = np.array(grid).transpose(1, 0, 2)
    crossed = 0
    for eye, order in zip(eyes, orders, strict=True):
        assert sorted(order) == list(range(1 - len(grid), 1))
        for target in rng.uniform([0, -7, 0], [13, 0, 5], (10, 3)):
            a, b = (low - eye) / (target - eye), (high - eye) / (target - eye)
            near, far = np.minimum(a, b).max(axis=1), np.maximum(a, b).min(axis=1)
            hit = np.flatnonzero(far > np.maximum(near, 0) + 1e-6)
            along = hit[np.argsort(near[hit])]
            crossed += len(along)
            assert (np.diff(np.array(order)[along]) < 0).all()  # nearer boxes are drawn later
    assert crossed > 3000


@pytest.mark.slow
@pytest.mark.parametrize("x", [-1.0, 1.0])
def test_the_farther_tile_is_blended_first(bundle: Path, imported: Import, x: float) -> None:
    found = imported(bundle, calls=[{"name": "SortFrom", "args": [x, 0, 0.1]}])
    order = {tile: box["order"] for tile, box in boxes(found["root"])}
    # The world is mirrored, so the first tile has the larger x.
    near, far = ("r0_c0", "r0_c1") if x > 0 else ("r0_c1", "r0_c0")
    assert (order[near], order[far]) == (0, -1)


def test_the_inspector_names_channels_and_functions(run: Run) -> None:
    found = json.loads(run("drawer").stdout)
    assert found["drawn"] == ["0+40 CD31", "40+20", "60+40 default, sharp 0"]
    assert (found["visible"], found["function"]) == (False, 1)  # the values after the clicks


def gaze(run: Run, *frames: tuple[str | None, float, int]) -> list[tuple[float, list[str]]]:
    each = [[target, dt] for target, dt, count in frames for _ in range(count)]
    done = run("gaze", json.dumps(each))
    assert done.returncode == 0, done.stderr.decode()
    return [(progress, shown) for progress, shown in json.loads(done.stdout)]


def test_a_gaze_of_one_and_a_half_seconds_switches_a_tile_once(run: Run) -> None:
    dt = 1 / 64  # s; exact in binary, so 1.5 s are 96 frames after the frame that starts the clock
    found = gaze(run, ("a", dt, 200), ("b", dt, 96), ("a", dt, 97), (None, dt, 5), ("b", 60.0, 3))
    shown = [names for _, names in found]
    assert shown[95] == []
    assert shown[96] == ["a"]
    assert shown[199] == ["a"]  # only one switch, however long the gaze lasts
    assert found[0][0] == 0
    assert found[48][0] == 0.5
    assert found[96][0] == 0
    assert shown[295] == ["a"]  # the gaze left b one frame too early
    assert shown[391] == ["a"]
    assert shown[392] == []  # back to surfaces
    assert shown[-1] == []  # a stall of the program does not count as a gaze
