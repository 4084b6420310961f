"""Compile the Unity package's scripts with Mono against stand-ins of Unity's classes (stubs/)."""

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from stereocell.engine.run import Engine
from support.bundles import write_bundle, write_tiles
from support.unity_assemblies import ASSEMBLIES, NEWTONSOFT, ZIP, compile_assembly

Run = Callable[..., subprocess.CompletedProcess[bytes]]


@pytest.fixture(scope="session")
def assemblies(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder with all assemblies, and with the harness that runs them."""
    has_zip = any(Path("/usr/lib/mono").glob(f"*/{ZIP}"))
    if not (shutil.which("mcs") and shutil.which("mono") and NEWTONSOFT.exists() and has_zip):
        pytest.skip("needs Mono and Newtonsoft.Json: run `make mono`")
    folder = tmp_path_factory.mktemp("assemblies")
    shutil.copy(NEWTONSOFT, folder)
    for name in ASSEMBLIES:
        compile_assembly(folder, name, "STEREOCELL_CARDBOARD", "ENABLE_LEGACY_INPUT_MANAGER")
    compile_assembly(folder, "harness", kind="exe")
    return folder


@pytest.fixture(scope="session")
def run(assemblies: Path, tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Run the harness with arguments and input. Each run has its own Unity project."""

    def run_harness(
        *args: object, data: bytes = b"", project: Path | None = None
    ) -> subprocess.CompletedProcess[bytes]:
        where = project or tmp_path_factory.mktemp("project")
        (where / "Assets").mkdir(exist_ok=True)
        command = ["mono", "--debug", str(assemblies / "harness.exe"), *map(str, args)]
        return subprocess.run(command, input=data, capture_output=True, timeout=120, cwd=where)

    return run_harness


@pytest.fixture(scope="session")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_tiles(tmp_path_factory.mktemp("stage"))


@pytest.fixture(scope="session")
def bundle(stage: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a bundle of two tiles and two channels, one without surfaces. Do not change it."""
    out = tmp_path_factory.mktemp("bundle") / "bundle"
    write_bundle(stage, out, None, engine=Engine(0))
    return out


@pytest.fixture
def imported(run: Run) -> Callable[..., Any]:
    """Import a bundle and return the harness's description of the imported objects."""

    def import_bundle(bundle: Path, **how: Any) -> Any:
        done = run("import", bundle, json.dumps(how))
        assert done.returncode == 0, done.stderr.decode()
        return json.loads(done.stdout)

    return import_bundle
