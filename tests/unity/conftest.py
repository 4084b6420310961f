"""The Unity package's scripts, compiled by Mono against stand-ins of Unity's classes (stubs/)."""

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from stereocell.engine.run import Engine
from support.bundles import write_bundle, write_tiles
from support.unity_meta import PACKAGE

HERE = Path(__file__).parent
NEWTONSOFT = Path("/usr/lib/cli/Newtonsoft.Json-5.0/Newtonsoft.Json.dll")  # Debian's
Run = Callable[..., subprocess.CompletedProcess[bytes]]


@pytest.fixture(scope="session")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Run Harness.cs: its arguments, and what it reads."""
    if not (shutil.which("mcs") and shutil.which("mono") and NEWTONSOFT.exists()):
        pytest.skip("needs Mono and Newtonsoft.Json: run `make mono`")
    folder = tmp_path_factory.mktemp("assemblies")
    shutil.copy(NEWTONSOFT, folder)
    stubs = HERE / "stubs"
    parts: list[tuple[str, Path, str]] = [
        ("UnityEngine.dll", stubs, "UnityEngine.cs"),
        ("UnityEditor.dll", stubs, "UnityEditor.cs"),
        ("nunit.framework.dll", stubs, "NUnit.cs"),
        ("StereoCell.dll", PACKAGE / "Runtime", "*.cs"),
        ("StereoCell.Editor.dll", PACKAGE / "Editor", "*.cs"),
        ("StereoCell.Tests.dll", PACKAGE / "Tests", "*.cs"),
        ("harness.exe", HERE, "Harness.cs"),
    ]
    before = [f"-r:{folder / NEWTONSOFT.name}"]
    for name, source, pattern in parts:
        # the package's own assemblies see no more than their .asmdef lets them
        seen = [r for r in before if "Runtime" not in str(source) or r.endswith("UnityEngine.dll")]
        kind = "exe" if name.endswith(".exe") else "library"
        # Unity 2022.3 takes C# 9; Mono's compiler knows 7
        done = subprocess.run(
            [
                *("mcs", "-langversion:7", "-warnaserror", f"-target:{kind}"),
                *(f"-out:{folder / name}", *seen, *sorted(map(str, source.rglob(pattern)))),
            ],
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        before.append(f"-r:{folder / name}")

    def run_harness(*args: object, data: bytes = b"") -> subprocess.CompletedProcess[bytes]:
        command = ["mono", "--debug", str(folder / "harness.exe"), *map(str, args)]
        return subprocess.run(command, input=data, capture_output=True, timeout=120, cwd=folder)

    return run_harness


@pytest.fixture(scope="session")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_tiles(tmp_path_factory.mktemp("stage"))


@pytest.fixture(scope="session")
def bundle(stage: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of two tiles and two channels, one without surfaces; to be read only."""
    out = tmp_path_factory.mktemp("bundle") / "bundle"
    write_bundle(stage, out, None, engine=Engine(0))
    return out


@pytest.fixture
def imported(run: Run, tmp_path: Path) -> Callable[..., Any]:
    """Import a bundle and return what the harness prints of it."""

    def import_bundle(bundle: Path, **how: Any) -> Any:
        done = run("import", bundle, tmp_path / "Assets" / "Mine", json.dumps(how))
        assert done.returncode == 0, done.stderr.decode()
        return json.loads(done.stdout)

    return import_bundle
