"""The Unity importer reads levels of volumes, many channels, and bundles with faults."""

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from pxr import Usd, UsdLux

from support.bundles import load, write
from support.edit_cases import define_arrow, define_camera
from support.stages import edit_over
from support.unity_import import boxes, volume_of

Run = Callable[..., subprocess.CompletedProcess[bytes]]
Import = Callable[..., Any]


@pytest.mark.slow
def test_large_volumes_are_read_at_a_coarser_level(bundle: Path, imported: Import) -> None:
    fine, coarse = imported(bundle), imported(bundle, mostTexels=12)
    for (tile, box), (_, whole) in zip(boxes(coarse["root"]), boxes(fine["root"]), strict=True):
        volume, _ = volume_of(bundle, "CD31", tile)
        sizes = [level["size"] for level in volume["levels"]]
        level = next(k for k, size in enumerate(sizes) if max(size) <= 12)
        assert level > 0
        assert box["material"]["_Volume"]["size"] == sizes[level]
        assert box["material"]["_MinStep"] == pytest.approx(2**level * whole["material"]["_Voxel"])
        same = ("_Size", "_TexLow", "_TexHigh", "_Voxel")
        assert all(box["material"][name] == whole["material"][name] for name in same)


@pytest.mark.slow
def test_more_than_four_channels_are_drawn_in_several_boxes(
    bundle: Path, imported: Import, tmp_path: Path
) -> None:
    shutil.copytree(bundle, tmp_path / "five")
    manifest = load(bundle / "manifest.json")
    channels = manifest["channels"]
    manifest["channels"] = [
        {**channels[i % 2], "id": f"c{i}", "name": f"channel {i}"} for i in range(5)
    ]
    (tmp_path / "five" / "manifest.json").write_text(json.dumps(manifest))
    found = imported(tmp_path / "five")
    for name in ("r0_c0", "r0_c1"):
        made = [box for tile, box in boxes(found["root"]) if tile == name]
        assert [box["channels"] for box in made] == [[0, 1, 2, 3], [4]]
        assert [box["material"]["_Volume"]["format"] for box in made] == ["RGBA32", "R8"]
        assert made[0]["name"] == "c0 + c1 + c2 + c3"
        assert [box["enabled"] for box in made] == [True, False]  # at first, four channels show
    files = [box["file"].split("-")[0] for _, box in boxes(found["root"])]
    assert files == ["r0_c0", "r0_c0_1", "r0_c1", "r0_c1_1"]
    assert [c["isVisible"] for c in found["channels"]] == [True] * 4 + [False]

    manifest["channels"][0]["opens"] = False  # the bundle states which channels it opens with
    (tmp_path / "five" / "manifest.json").write_text(json.dumps(manifest))
    found = imported(tmp_path / "five")
    assert [c["isVisible"] for c in found["channels"]] == [False, True, True, True, True]


@pytest.mark.slow
def test_additions_that_unity_does_not_import_are_listed(
    stage: Path, bundle: Path, imported: Import, tmp_path: Path
) -> None:
    def change(edited: Usd.Stage) -> None:
        define_arrow(edited)
        define_camera(edited)
        UsdLux.DistantLight.Define(edited, "/Specimen/Lights/Sun")

    assert imported(bundle)["warnings"] == []
    write(edit_over(tmp_path / "edited.usda", stage, change), tmp_path / "bundle")
    (line,) = imported(tmp_path / "bundle")["warnings"]
    words = "not imported: added meshes (additions.glb), lamps, cameras"
    assert line.endswith(words)


@pytest.mark.slow
def test_a_faulty_bundle_is_refused_in_one_line(run: Run, bundle: Path, tmp_path: Path) -> None:
    def refuse(name: str, spoil: Callable[[Path], None], *expected: str, **how: Any) -> None:
        copy = tmp_path / name
        shutil.copytree(bundle, copy)
        spoil(copy)
        done = run("import", copy, json.dumps(how))
        assert done.returncode == 1
        line = done.stderr.decode().strip()
        assert "\n" not in line
        assert all(part in line for part in expected), line
        assert not done.stdout

    def change(path: str, **values: Any) -> Callable[[Path], None]:
        def write(folder: Path) -> None:
            content = {**load(folder / path), **values}
            (folder / path).write_text(json.dumps(content))

        return write

    def rename(what: str) -> Callable[[Path], None]:
        def write(folder: Path) -> None:
            manifest = load(folder / "manifest.json")
            manifest[what][0]["id"] = "../../x"
            (folder / "manifest.json").write_text(json.dumps(manifest))

        return write

    def lead_out(folder: Path) -> None:
        manifest = load(folder / "manifest.json")
        manifest["files"]["path"] = "../files.json"
        (folder / "manifest.json").write_text(json.dumps(manifest))

    def flip(path: str) -> Callable[[Path], None]:
        def write(folder: Path) -> None:
            data = bytearray((folder / path).read_bytes())
            data[-1] ^= 1
            (folder / path).write_bytes(data)

        return write

    volume, _ = volume_of(bundle, "CD31", "r0_c1")
    place = volume["file"]["path"]
    glb = "channels/CD31/r0_c0/lod1.glb"
    refuse("flipped", flip(place), place, "SHA-256")
    refuse("glb", flip(glb), glb, "SHA-256")
    refuse("gone", lambda folder: (folder / place).unlink(), place, "missing")
    refuse("cut", lambda folder: (folder / place).write_bytes(b"\xabKTX"), place, "size is 4 bytes")
    refuse("newer", change("manifest.json", version=2), "version is 2, expected 1")
    refuse("other", change("manifest.json", format="x"), "expected stereocell-bundle")
    refuse("json", lambda f: (f / "manifest.json").write_text("{"), "manifest.json")
    refuse("bare", change("manifest.json", tiles=None, specimen={}), "specimen.name")
    refuse("outside", lead_out, "../files.json", "leads out")
    refuse("tile", rename("tiles"), "../../x", "identifier")
    refuse("channel", rename("channels"), "../../x", "identifier")
    refuse("empty", lambda f: (f / "manifest.json").unlink(), "manifest.json", "missing")
    refuse("no glTFast", lambda f: None, "was not imported", "glTFast", gltf=False)
