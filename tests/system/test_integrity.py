"""A flipped bit in a file of a build, or a missing file, is noticed, named and repaired.

Each flip keeps the file's size. A `silent` flip also keeps its time, as on a failing disk.
"""

import json
import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Sdf

from stereocell.building.out_folder import OutFolder
from stereocell.cli.__main__ import main
from stereocell.steps.unit_files import find_damage, is_whole
from stereocell.storage import file_list
from stereocell.verify.check_line import CheckLine
from stereocell.verify.formats import check
from support import phantoms
from support.digests import digests_of
from support.exhaustive import sweep

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("without_node")]

# Names with a space and an apostrophe; the second channel has no surface.
NAMES = ["Alice's F", "empty"]
F = "Alice_x27_s_x20_F"
UNIT_FILES = ["unit.json", "voxels.npz", "lod0.npz", "closed.stl"]
STAGE_FILES = [
    f"tiles/r0_c0/{F}.exr",
    f"tiles/r0_c0/{F}.vdb",
    f"tiles/r0_c0/{F}_closed.stl",
    f"tiles/r0_c0/{F}_lod1_normal.png",
    f"looks/{F}_default.exr",
    "specimen.usdz",
]
FLAGS = ["--workers", "0"]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("a build's place")
    body = phantoms.f_phantom()
    voxels = np.stack([body, np.full_like(body, 300)])
    source = phantoms.write_ome_tiff(folder / "f.ome.tif", voxels, "CZYX", names=NAMES)
    plan = ["plan", str(source), "-o", str(folder / "out"), "--grid", "2x1"]
    plan += ["--closed-tiles", "--maps"]
    assert main(plan) == 0
    _go_on(folder / "out")
    return folder / "out"


@pytest.fixture
def out(built: Path, tmp_path: Path) -> Path:
    return shutil.copytree(built, tmp_path / "out")


def _go_on(out: Path) -> None:
    for phase in ("units", "stage", "bundle"):
        assert main([phase, str(out), *FLAGS]) == 0


def _unit(out: Path) -> Path:
    return OutFolder(out).unit_dir(f"r0_c0/{F}", OutFolder(out).index()[f"r0_c0/{F}"])


def _flip(file: Path, *, silent: bool = False) -> None:
    """Flip one bit in the middle of a file."""
    status = file.stat()
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1
    file.write_bytes(data)
    if silent:
        os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))


def _line(out: Path, name: str) -> CheckLine:
    return next(line for line in check(out) if line.name == name)


def _assets(out: Path) -> dict[str, str]:
    return {
        name: digest
        for part in ("units", "stage", "bundle")
        for name, digest in digests_of(out / part).items()
        if not name.endswith("seconds.json")
    }


# --- units


@pytest.mark.parametrize("name", UNIT_FILES)
@pytest.mark.parametrize("silent", [False, True])
def test_flipped_bit_of_a_unit_is_named_by_check(out: Path, name: str, silent: bool) -> None:
    assert _line(out, "units").ok
    _flip(_unit(out) / name, silent=silent)
    line = _line(out, "units")
    assert not line.ok
    assert f"{_unit(out).relative_to(out)}/{name}: damaged" in line.detail
    assert "run `stereocell units OUT`" in line.detail


@pytest.mark.parametrize("name", sweep(UNIT_FILES, kept=["voxels.npz"]))
def test_unit_with_a_flipped_bit_is_made_again(out: Path, built: Path, name: str) -> None:
    _flip(_unit(out) / name)
    _go_on(out)
    assert _assets(out) == _assets(built)


@pytest.mark.parametrize("name", sweep(UNIT_FILES, kept=["unit.json", "lod0.npz"]))
def test_no_flipped_bit_of_a_unit_gets_into_the_stage(
    out: Path, built: Path, capfd: pytest.CaptureFixture[str], name: str
) -> None:
    shutil.rmtree(out / "stage")
    _flip(_unit(out) / name, silent=True)
    capfd.readouterr()
    if name == "unit.json":  # each command reads it, and so notices the damage
        assert not is_whole(_unit(out))
    assert main(["stage", str(out), *FLAGS]) == 1
    printed = capfd.readouterr().err
    assert f"{_unit(out) / name}: damaged" in printed
    assert f"remove {_unit(out)} and run `stereocell units {out}`" in printed
    assert "Traceback" not in printed
    shutil.rmtree(_unit(out))
    _go_on(out)
    assert _assets(out) == _assets(built)


def test_missing_file_of_a_unit_is_named(out: Path) -> None:
    (_unit(out) / "lod1.npz").unlink()
    assert find_damage(_unit(out)) == {"lod1.npz": "missing"}
    assert "lod1.npz: missing" in _line(out, "units").detail


def test_each_damaged_file_is_named(out: Path) -> None:
    folder = out / "stage" / "tiles" / "r0_c0"
    files = sorted(folder.glob("*.png"))
    assert len(files) > 3
    for file in files:
        _flip(file)
    detail = _line(out, "stage hashes").detail
    assert all(f"stage/tiles/r0_c0/{file.name}: damaged" in detail for file in files)


def _change_a_digit(file: Path) -> None:
    """Change one digit of the first fraction in a JSON file; size and time stay the same."""
    status, text = file.stat(), file.read_text("utf-8")
    place = next(re.finditer(r"[1-9]\d*\.\d", text)).start()
    digit = "2" if text[place] == "1" else "1"
    file.write_text(text[:place] + digit + text[place + 1 :])
    os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))


@pytest.mark.parametrize(
    "name",
    sweep(
        [f"window-{F}-*.json", f"r0_c0/{F}/components-*.json", "survey.json"],
        kept=[f"window-{F}-*.json", "survey.json"],
    ),
)
def test_damaged_inputs_of_units_are_named_and_computed_again(
    out: Path, built: Path, capfd: pytest.CaptureFixture[str], name: str
) -> None:
    (file,) = (out / "units").glob(name)
    _change_a_digit(file)
    line = _line(out, "units")
    assert not line.ok
    assert f"{file.relative_to(out).as_posix()}: damaged" in line.detail
    shutil.rmtree(out / "stage")
    capfd.readouterr()
    if name == "survey.json":
        assert main(["stage", str(out), *FLAGS]) == 1
        printed = capfd.readouterr().err
        assert f"{file}: damaged or changed by hand: its content has SHA-256" in printed
        assert f"run `stereocell units {out}`" in printed
    _go_on(out)
    assert _assets(out) == _assets(built)


# --- the stage


def test_stage_s_list_of_hashes_has_all_files_of_the_stage(built: Path) -> None:
    listed = json.loads((built / "stage" / "files.json").read_bytes())
    written = digests_of(built / "stage")
    del written["files.json"]
    assert {path: entry["sha256"] for path, entry in listed.items()} == written
    assert set(STAGE_FILES) <= set(listed)
    assert list(listed) == sorted(listed)


@pytest.mark.parametrize("name", STAGE_FILES)
@pytest.mark.parametrize("silent", [False, True])
def test_flipped_bit_of_the_stage_is_named_by_check(out: Path, name: str, silent: bool) -> None:
    assert _line(out, "stage hashes").ok
    _flip(out / "stage" / name, silent=silent)
    line = _line(out, "stage hashes")
    assert not line.ok
    assert f"stage/{name}: damaged" in line.detail
    assert "remove the damaged files and run `stereocell stage OUT`" in line.detail
    (out / "stage" / name).unlink()
    assert f"stage/{name}: missing" in _line(out, "stage hashes").detail


@pytest.mark.parametrize("name", sweep(STAGE_FILES, kept=[STAGE_FILES[1], "specimen.usdz"]))
def test_file_of_the_stage_with_a_flipped_bit_is_made_again(
    out: Path, built: Path, name: str
) -> None:
    _flip(out / "stage" / name)
    _go_on(out)
    assert _assets(out) == _assets(built)


@pytest.mark.parametrize("name", sweep([*STAGE_FILES[:2], STAGE_FILES[3]], kept=STAGE_FILES[:2]))
def test_no_flipped_bit_of_the_stage_gets_into_the_bundle(
    out: Path, built: Path, capfd: pytest.CaptureFixture[str], name: str
) -> None:
    shutil.rmtree(out / "bundle")
    _flip(out / "stage" / name, silent=True)
    capfd.readouterr()
    assert main(["bundle", str(out), *FLAGS]) == 1
    printed = capfd.readouterr().err
    assert (
        f"{name}: damaged, because its size or hash differs from files.json: remove it and run"
        in printed
    )
    assert f"`stereocell stage {out}`" in printed
    assert "Traceback" not in printed
    assert not (out / "bundle").exists()
    (out / "stage" / name).unlink()
    _go_on(out)
    assert _assets(out) == _assets(built)


@pytest.mark.parametrize(
    "name",
    sweep(
        [f"volumes/r0_c0/{F}.ktx2", f"channels/{F}/r0_c0/lod0.glb"],
        kept=[f"channels/{F}/r0_c0/lod0.glb"],
    ),
)
def test_file_of_the_bundle_with_a_flipped_bit_is_made_again(
    out: Path, built: Path, name: str
) -> None:
    _go_on(out)  # makes the bundle from the copied stage
    _flip(out / "bundle" / name)
    assert f"{name}: its size or hash differs" in _line(out, "hashes").detail
    _go_on(out)
    assert _assets(out) == _assets(built)


def test_damaged_manifest_is_named_and_made_again(out: Path, built: Path) -> None:
    _go_on(out)  # the copied OUT gets a bundle of its own stage
    assert _line(out, "hashes").ok
    _change_a_digit(out / "bundle" / "manifest.json")
    line = _line(out, "hashes")
    assert not line.ok
    assert "manifest.json: damaged or changed by hand" in line.detail
    assert "run `stereocell bundle OUT`" in line.detail
    _go_on(out)
    assert _assets(out) == _assets(built)


def _recolour(layer_file: Path) -> None:
    layer = Sdf.Layer.OpenAsAnonymous(str(layer_file))
    layer.GetAttributeAtPath(f"/Specimen/Channels/{F}.inputs:color").default = (1, 0, 0)
    layer.Export(str(layer_file))


def _retint(layer_file: Path) -> None:
    layer = Sdf.Layer.OpenAsAnonymous(str(layer_file))
    layer.comment = "moved by hand"
    layer.Export(str(layer_file))


@pytest.mark.parametrize(
    ("name", "change"),
    [("looks/channels.usda", _recolour), ("tiles/r0_c0/tile.usdc", _retint)],
)
def test_layer_edited_in_place_stays_and_is_called_edited_or_damaged(
    out: Path, capfd: pytest.CaptureFixture[str], name: str, change: Callable[[Path], None]
) -> None:
    file = out / "stage" / name
    change(file)
    edited = file.read_bytes()
    capfd.readouterr()
    _go_on(out)
    printed = capfd.readouterr().err
    assert (
        f"{name}: changed since it was written, by an edit or by damage, and is used as" in printed
    )
    assert file.read_bytes() == edited
    line = _line(out, "stage hashes")
    assert f"stage/{name}: changed since it was written, by an edit or by dam" in line.detail
    assert "put edits into a layer of your own" in line.detail
    manifest = json.loads((out / "bundle" / "manifest.json").read_text("utf-8"))
    assert (manifest["channels"][0]["color"] == [1, 0, 0]) == (change is _recolour)


@pytest.mark.parametrize("silent", sweep([False, True], kept=[True]))
def test_binary_layer_with_a_flipped_bit_gets_into_no_bundle_and_is_not_overwritten(
    out: Path, built: Path, capfd: pytest.CaptureFixture[str], silent: bool
) -> None:
    """USD can open the file, so somebody may have edited it without changing its size."""
    file = out / "stage" / "tiles" / "r0_c0" / "tile.usdc"
    shutil.rmtree(out / "bundle")
    _flip(file, silent=silent)
    flipped = file.read_bytes()
    both = "tile.usdc: changed since it was written but kept its size, by damage or by an edit"
    assert both in _line(out, "stage hashes").detail
    assert main(["stage", str(out), *FLAGS]) == 0
    capfd.readouterr()
    assert main(["bundle", str(out), *FLAGS]) == 1
    printed = capfd.readouterr().err
    assert f"{both}: remove it and run `stereocell stage {out}`" in printed
    assert file.read_bytes() == flipped
    file.unlink()
    _go_on(out)
    assert _assets(out) == _assets(built)


def test_layer_that_no_longer_opens_is_damaged(
    out: Path, built: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    shutil.rmtree(out / "bundle")
    file = out / "stage" / "tiles" / "r0_c0" / "tile.usdc"
    status = file.stat()
    data = bytearray(file.read_bytes())
    data[:8] = bytes(8)  # overwrites the magic number PXR-USDC
    file.write_bytes(data)
    os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))
    assert "tile.usdc: damaged" in _line(out, "stage hashes").detail
    capfd.readouterr()
    assert main(["bundle", str(out), *FLAGS]) == 1
    assert (
        "tile.usdc: damaged, because its size or hash differs from files.json"
        in capfd.readouterr().err
    )
    file.unlink()
    _go_on(out)
    assert _assets(out) == _assets(built)


def test_files_that_an_artist_adds_are_not_damage_and_stay(out: Path, built: Path) -> None:
    own = [out / "stage" / name for name in ("mine.usda", "tiles/r0_c0/my own.png")]
    for file in own:
        file.write_text("#usda 1.0\n")
    assert _line(out, "stage hashes").ok
    made = (out / "stage" / "stage.usda").stat().st_mtime_ns
    _go_on(out)
    assert all(file.is_file() for file in own)
    assert (out / "stage" / "stage.usda").stat().st_mtime_ns == made


def _empty(file: Path) -> None:
    file.write_text("{}")


@pytest.mark.parametrize("spoil", sweep([Path.unlink, _flip, _empty], kept=[Path.unlink, _flip]))
def test_missing_or_damaged_list_is_made_again(
    out: Path, built: Path, spoil: Callable[[Path], None]
) -> None:
    spoil(out / "stage" / "files.json")
    line = _line(out, "stage hashes")
    assert not line.ok
    assert "files.json" in line.detail
    _go_on(out)
    assert _assets(out) == _assets(built)


def test_bundle_of_a_layer_elsewhere_reads_no_damaged_file(
    out: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    edit = tmp_path / "edit.usda"
    edit.write_text(f"#usda 1.0\n(\n    subLayers = [@{out}/stage/stage.usda@]\n)\n")
    assert main(["bundle", str(out), *FLAGS, "--stage", str(edit)]) == 0
    shutil.rmtree(out / "bundle")
    _flip(out / "stage" / STAGE_FILES[0], silent=True)
    assert main(["bundle", str(out), *FLAGS, "--stage", str(edit)]) == 1
    assert f"{STAGE_FILES[0]}: damaged" in capfd.readouterr().err


# --- the cost of checks


def _count_hashed(hashed: list[Path], monkeypatch: pytest.MonkeyPatch) -> None:
    measure = file_list.measure

    def count(file: Path) -> dict[str, Any]:
        hashed.append(file)
        return measure(file)

    monkeypatch.setattr(file_list, "measure", count)


def test_a_build_with_nothing_to_do_reads_no_file_of_units_and_stage(
    out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _go_on(out)  # makes the bundle from the copied stage
    hashed: list[Path] = []
    _count_hashed(hashed, monkeypatch)
    _go_on(out)
    assert [file for file in hashed if (out / "bundle") not in file.parents] == []


def test_a_copy_with_new_times_is_hashed_once(
    built: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = shutil.copytree(built, tmp_path / "out")
    now = (_unit(out) / "unit.json").stat().st_mtime_ns + 10**9
    for name in ("voxels.npz", "lod0.npz"):
        os.utime(_unit(out) / name, ns=(now, now))
    hashed: list[Path] = []
    _count_hashed(hashed, monkeypatch)
    assert is_whole(_unit(out))
    assert sorted(file.name for file in hashed) == ["lod0.npz", "voxels.npz"]
    hashed.clear()
    assert is_whole(_unit(out))
    assert hashed == []
