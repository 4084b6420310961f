"""Builds without maps do not need the extra `maps`; `--maps` asks for it before any work."""

import sys
from pathlib import Path

import numpy as np
import pytest

from stereocell.building.out_folder import OutFolder
from stereocell.cli.__main__ import main
from stereocell.engine.step_record import libraries_of
from stereocell.textures import map_packages
from stereocell.textures.map_packages import unwrapper_version
from support.phantoms import blurred_ball, write_ome_tiff

SPACING = (0.5, 0.25, 0.25)
PACKAGES = (map_packages.UNWRAPPER, map_packages.ENCODER)


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("source") / "ball.ome.tif"
    ball = 1000 * blurred_ball((24, 40, 40), SPACING, (6.0, 5.0, 5.0), 3.0, 0.3)
    write_ome_tiff(path, ball.astype(np.uint16), spacing=SPACING)
    return str(path)


def keys(out: Path) -> tuple[dict[str, str], str]:
    """Return the names of the folders of a build's units, and of its bundle."""
    folder = OutFolder(out)
    return folder.index(), str(folder.phases()["bundle"]["key"])


@pytest.mark.parametrize("package", PACKAGES)
def test_maps_are_refused_before_any_work_if_a_package_is_missing(
    source: str,
    package: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    out = tmp_path / "out"
    assert main(["build", source, "-o", str(out), "--maps"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"--maps needs the package {package}: " in line
    assert line.endswith("pip install 'stereocell[maps]'")
    assert not out.exists()


def test_no_step_depends_on_a_package_for_maps_by_its_imports() -> None:
    named = libraries_of("BuildUnit", "WriteStage", "WriteBundle", "WriteReport")
    assert "numpy" in named
    assert not {"xatlas", "alktx2"} & named.keys()


@pytest.mark.slow
def test_a_build_without_maps_does_not_depend_on_packages_for_maps(
    source: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    command = ["build", source, "-o", str(out), "--workers", "0"]
    assert main(command) == 0
    there = keys(out)
    for package in PACKAGES:
        monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.setattr(map_packages, "version_of", lambda package: "")
    assert main(command) == 0
    assert keys(out) == there
    assert main([*command[:3], str(tmp_path / "again"), "--workers", "0"]) == 0
    assert keys(tmp_path / "again")[0] == there[0]
    assert main(["check", "--deep", "--workers", "0", str(tmp_path / "again")]) == 0


@pytest.mark.slow
def test_another_version_of_a_package_for_maps_makes_results_with_maps_again(
    source: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    command = ["build", source, "-o", str(out), "--workers", "0", "--maps"]
    assert main(command) == 0
    units, bundle = keys(out)
    monkeypatch.setattr("stereocell.building.bundle_inputs.encoder_version", lambda: "99")
    assert main(command) == 0
    assert keys(out)[0] == units
    assert keys(out)[1] != bundle
    monkeypatch.setattr("stereocell.planning.unit_steps.unwrapper_version", lambda: "99")
    assert main(command) == 0
    assert all(key != units[name] for name, key in keys(out)[0].items())

    for package in PACKAGES:
        monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.setattr("stereocell.planning.unit_steps.unwrapper_version", unwrapper_version)
    capsys.readouterr()
    for phase in ("bundle", "units"):
        assert main([phase, str(out), "--workers", "0"]) == 2
        assert capsys.readouterr().err.endswith("pip install 'stereocell[maps]'\n")
    assert main(["check", "--deep", "--workers", "0", str(out)]) == 1
    printed = capsys.readouterr()
    assert "a surface with baked maps needs the package alktx2" in printed.out + printed.err
