"""`stereocell.build` in Python does the same as the command."""

import inspect
import re
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import stereocell
from stereocell.cli.__main__ import main
from stereocell.engine.run import TasksFailedError
from support import phantoms
from support.digests import digests_of


@pytest.mark.slow
def test_build_does_what_the_command_does(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = phantoms.write_ome_tiff(tmp_path / "f.ome.tif", phantoms.f_phantom()[None], "CZYX")
    built = stereocell.build(source, tmp_path / "a", settings={"plan": {"grid": "2x1"}})
    assert built.stage == f"{tmp_path}/a/stage/stage.usda"
    assert all(Path(path).exists() for path in (built.stage, built.bundle, built.report))
    capsys.readouterr()
    command = ["build", str(source), "-o", str(tmp_path / "a"), "--grid", "2x1", "--workers", "0"]
    assert main(command) == 0
    printed = capsys.readouterr().err
    for phase in ("plan", "units", "stage", "bundle", "report"):
        assert f"{phase}: up to date" in printed  # the command finds nothing left to do


def test_wrong_arguments_raise_an_error_of_one_line(tmp_path: Path) -> None:
    with pytest.raises(stereocell.StereoCellError, match=r"none.ome.tif: not found") as raised:
        stereocell.build(tmp_path / "none.ome.tif", tmp_path / "out")
    assert "\n" not in str(raised.value)
    with pytest.raises(stereocell.StereoCellError, match="grids"):
        stereocell.build(tmp_path / "f.tif", tmp_path / "out", settings={"plan": {"grids": "2x1"}})
    with pytest.raises(stereocell.StereoCellError, match="workers is -1, expected"):
        stereocell.build(tmp_path, tmp_path / "out", workers=-1)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ({"workers": "2"}, "workers is '2', expected a whole number, 0 or more"),
        ({"workers": 2.5}, "workers is 2.5, expected a whole number, 0 or more"),
        ({"settings": [1]}, "settings is [1], expected sections with keys, such as {'plan'"),
        ({"settings": {"plan": {"grid": 3}}}, "settings: plan.grid is 3"),
        ({"preset": 3}, "preset is 3, expected a preset's name or a TOML file"),
        ({"config": 3}, "config is 3, expected a TOML file"),
        ({"out": None}, "out is None, expected a path or an address"),
    ],
)
def test_argument_of_a_wrong_type_is_named(
    tmp_path: Path, arguments: dict[str, Any], line: str
) -> None:
    with pytest.raises(stereocell.StereoCellError, match=f"^{re.escape(line)}"):
        stereocell.build(tmp_path / "f.ome.tif", **{"out": tmp_path / "out", **arguments})
    assert not (tmp_path / "out").exists()


def test_source_is_read_from_the_given_place(tmp_path: Path) -> None:
    body = phantoms.f_phantom()
    source = phantoms.write_ome_tiff(tmp_path / "f.ome.tif", body[None], "CZYX")
    dataset = stereocell.open_volume(source)
    volume = dataset.read(0, dataset.levels[0].box, 0)
    assert (volume.voxels == body).all()


ARRAY = np.arange(4 * 8 * 8, dtype=np.uint16).reshape(4, 8, 8)


@pytest.mark.parametrize("name", ["build", "show", "show an array"])
def test_functions_that_write_keep_foreign_files_and_name_the_argument_that_replaces_them(
    tmp_path: Path, name: str
) -> None:
    source = phantoms.write_ome_tiff(tmp_path / "f.ome.tif", phantoms.f_phantom()[None], "CZYX")
    out = tmp_path / "out"
    out.mkdir()
    (out / "thesis.tex").write_text("years of work")
    before = digests_of(tmp_path)
    write = {
        "build": partial(stereocell.build, source, out),
        "show": partial(stereocell.show, source, out=out),
        "show an array": partial(stereocell.show, ARRAY, spacing_um=(1, 1, 1), out=out),
    }[name]
    with pytest.raises(stereocell.StereoCellError, match=r"force=True replaces it$") as raised:
        write()
    assert "thesis.tex" in str(raised.value)
    assert "--" not in str(raised.value)
    assert digests_of(tmp_path) == before


def test_error_of_a_later_phase_also_names_the_argument(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise TasksFailedError("r0_c0/F: its worker was killed: expected fewer --workers")

    source = phantoms.write_ome_tiff(tmp_path / "f.ome.tif", phantoms.f_phantom()[None], "CZYX")
    monkeypatch.setattr("stereocell.building.phases.run_units", fail)
    with pytest.raises(TasksFailedError, match=r"expected fewer workers$"):
        stereocell.build(source, tmp_path / "out")


def test_every_function_that_writes_takes_force() -> None:
    public = (getattr(stereocell, name) for name in stereocell.__all__)
    taking = {
        one.__name__: inspect.signature(one).parameters
        for one in public
        if inspect.isfunction(one) and "out" in inspect.signature(one).parameters
    }
    assert taking.keys() == {"build", "show"}
    assert all(parameters["force"].default is False for parameters in taking.values())
