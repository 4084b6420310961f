"""The folder into which a source is built is checked before anything is shown."""

import os
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tifffile

from stereocell.building.out_folder import OutFolder
from stereocell.live.build_place import finished_bundle, free_place, require_place
from stereocell.model.errors import OutputError, UsageError
from stereocell.planning.plan import Plan
from stereocell.planning.preset_choice import load_for
from stereocell.planning.settle import settle
from stereocell.storage.lock import alone_in
from support.phantoms import f_phantom, write_ome_tiff


def plan_of(source: Path) -> Plan:
    settings, choice = load_for(str(source), None, None, flags={})
    return settle(str(source), settings, choice)


@pytest.fixture
def plans(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Plan]:
    """Two specimens whose files have the same name, and of the first one a plan in a.stereocell."""
    made = []
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        file = tmp_path / folder / "cell.ome.tif"
        voxels = f_phantom(2 if folder == "a" else 3)
        made.append(plan_of(write_ome_tiff(file, voxels, spacing=(1.0, 0.5, 0.5))))
    monkeypatch.chdir(tmp_path)
    return made


def test_a_second_specimen_of_one_name_gets_a_folder_of_its_own(plans: list[Plan]) -> None:
    first, second = plans
    assert first.name == second.name == "cell"
    place = free_place(first)
    assert place == Path("cell.stereocell")
    require_place(first.source, place, first)
    assert not place.exists()
    OutFolder(place).save_plan(first)
    assert free_place(second) == Path("cell-2.stereocell")
    Path("cell-2.stereocell").mkdir()
    Path("cell-2.stereocell/letter.txt").write_text("not a build")
    assert free_place(second) == Path("cell-3.stereocell")
    assert free_place(first) == place


def test_a_source_that_is_the_working_folder_gets_a_folder_beside_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scan = tmp_path / "scan"
    for z in range(3):
        (scan / "deep").mkdir(parents=True, exist_ok=True)
        tifffile.imwrite(scan / f"{z}.tif", np.full((8, 9), 100 * z, np.uint16))
    settings, choice = load_for(str(scan), None, None, flags={"plan": {"spacing_um": (1, 1, 1)}})
    plan = settle(str(scan), settings, choice)
    for working in (scan, scan / "deep"):
        monkeypatch.chdir(working)
        place = free_place(plan)
        assert place == tmp_path / f"{plan.name}.stereocell"
        require_place(str(scan), place, plan)


def test_a_folder_that_a_build_would_refuse_is_refused_at_once(plans: list[Plan]) -> None:
    first, second = plans
    out = Path("out")
    require_place(first.source, out, first)
    OutFolder(out).save_plan(first)
    with pytest.raises(OutputError, match=r"holds a build of .*: choose another OUT$"):
        require_place(second.source, out, second)
    require_place(first.source, out, replace(first, notes=("another note",)))
    with pytest.raises(UsageError, match="inside the input"):
        require_place("planes.ome.zarr", Path("planes.ome.zarr/out"), first)
    Path("letters").mkdir()
    Path("letters/one.txt").write_text("not a build")
    with pytest.raises(OutputError, match="letters"):
        require_place(first.source, Path("letters"), first)


@pytest.mark.skipif(
    sys.platform == "win32" or os.geteuid() == 0, reason="everything can be written here"
)
def test_a_folder_that_can_not_be_written_is_refused(plans: list[Plan]) -> None:
    Path("closed").mkdir(mode=0o555)
    with pytest.raises(OutputError, match="can't be written"):
        require_place(plans[0].source, Path("closed/out"), plans[0])


def test_a_folder_into_which_another_command_writes_is_refused(plans: list[Plan]) -> None:
    with (
        alone_in(Path("out"), "build"),
        pytest.raises(OutputError, match=r"`stereocell build` .* is writing here"),
    ):
        require_place(plans[0].source, Path("out"), plans[0])


def test_a_build_without_results_has_no_finished_bundle(plans: list[Plan]) -> None:
    first, _ = plans
    assert finished_bundle(Path("none"), first) is None
    require_place(first.source, Path("out"), first)
    OutFolder(Path("out")).save_plan(first)
    assert finished_bundle(Path("out"), first) is None
