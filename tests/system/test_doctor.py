"""`stereocell doctor` on this machine, and on one that has no optional programs."""

import json
import re
import shutil
import subprocess
import sys
import tomllib
from collections import namedtuple
from importlib import metadata
from pathlib import Path

import pytest

from stereocell.cli import doctor
from stereocell.cli.__main__ import main

ROOT = Path(__file__).parents[2]
Usage = namedtuple("Usage", "total used free")


def test_each_missing_thing_has_a_cost(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["ok"]
    assert {one["name"] for one in answer["found"]} >= {"Python", "memory", "disk", "GPU"}
    for one in answer["found"]:
        assert one["found"]
        assert bool(one["cost"]) != one["ok"]
    assert main(["doctor"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == len(answer["found"])


def test_on_a_bare_machine(tmp_path: Path) -> None:
    """The PATH names an empty folder, and HOME is the only other variable."""
    answer = subprocess.run(
        [sys.executable, "-m", "stereocell.cli", "doctor", "--json"],
        env={"HOME": str(tmp_path), "PATH": str(tmp_path)},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    found = {one["name"]: one for one in json.loads(answer.stdout)["found"]}
    assert not found["browser"]["ok"]
    assert "--lan" in found["browser"]["cost"]
    assert not found["Node.js"]["ok"]
    assert answer.stderr == ""


def test_missing_packages_are_named_without_a_traceback(tmp_path: Path) -> None:
    about = Path(str(metadata.distribution("stereocell")._path))  # type: ignore[attr-defined]
    shutil.copytree(about, tmp_path / about.name)
    code = Path(doctor.__file__).parents[2]
    outputs = {}
    for name in ("doctor", "settings", "plan"):
        command = [sys.executable, "-S", "-m", "stereocell.cli", name]
        ended = subprocess.run(
            [*command, *(["x.tif", "-o", "out"] if name == "plan" else [])],
            env={"PYTHONPATH": f"{code}:{tmp_path}", "PATH": ""},
            cwd=tmp_path,
            capture_output=True,
            text=True,
        )
        assert ended.returncode == 1
        outputs[name] = (ended.stdout, ended.stderr)
    printed, faults = outputs["doctor"]
    assert faults == ""
    (packages,) = [line for line in printed.splitlines() if line.startswith("missing packages: ")]
    assert {"numpy", "zarr", "usd-core", "vtk"} <= set(re.findall(r"[\w-]+", packages))
    for name in ("settings", "plan"):
        assert re.fullmatch(
            r"stereocell: the package \w+ is missing: install StereoCell again "
            r"\(`stereocell doctor` lists all missing packages\)\n",
            outputs[name][1],
        )
    assert not (tmp_path / "out").exists()


def test_missing_requirement_fails(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    named = [
        "numpy>=2",
        "zarr>=99",
        "no-such-package>=1; python_version > '3'",
        "x>1; extra == 'y'",
    ]
    lacking = lambda name: named  # noqa: E731
    monkeypatch.setattr(doctor, "requires", lacking)
    monkeypatch.setattr(shutil, "disk_usage", lambda path: Usage(0, 0, 3 << 30))
    monkeypatch.setattr(doctor, "available_bytes", lambda: 1 << 30)
    assert main(["doctor"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].startswith("missing packages: zarr is ")
    assert ", expected >=99; no-such-package is missing: commands that need them fail" in lines[1]
    joined = "\n".join(lines)
    assert "without memory: 1.0 GiB available: 0 workers" in joined
    assert "without disk: 3.0 GiB free in this folder: a large build may not fit" in joined


def test_check_that_needs_a_missing_package_names_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def lacking() -> int:
        import no_such_package  # noqa: F401

        return 0

    monkeypatch.setattr(doctor, "available_bytes", lacking)
    assert main(["doctor"]) == 0
    printed = capsys.readouterr().out
    assert "without memory: No module named 'no_such_package'" in printed
    assert "without disk" in printed or "ok      disk" in printed


def test_removed_folder_does_not_end_the_checks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    assert main(["doctor"]) == 0
    printed = capsys.readouterr().out
    assert "without disk: No such file or directory: can't be examined\n" in printed
    assert "GPU" in printed


def test_browser_and_node_must_exist_and_be_new_enough(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    node = tmp_path / "node"
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    for version, is_new in (("v18.2.0", False), ("v20.19.0", True), ("oh", False)):
        node.write_text(f"#!/bin/sh\necho {version}\n")
        node.chmod(0o755)
        assert doctor._node().ok == is_new
    for browser, is_there in (("no-such-browser", False), ("no-such:node %s", True)):
        monkeypatch.setenv("BROWSER", browser)
        assert doctor._browser().ok == is_there


def test_extras_are_reported_as_optional(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "find_spec", lambda module: None)
    found = {one.name: one for one in doctor.examine()}
    pyproject = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    extras = pyproject["project"]["optional-dependencies"]
    assert {f"extra {name}" for name in extras} == {n for n in found if n.startswith("extra ")}
    for name in extras:
        look = found[f"extra {name}"]
        assert not look.ok
        assert look.cost.startswith("optional, ")
        assert f"pip install 'stereocell[{name}]'" in look.cost
    assert "--maps" in found["extra maps"].cost
