"""The wheel: installed by itself it builds, and its bundles have the viewer, without Node."""

import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import sysconfig
import tarfile
import venv
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.request import urlopen

import pytest
from packaging.metadata import Metadata

from stereocell.storage.assets import viewer_dist

ROOT = Path(__file__).parents[2]


def environment() -> dict[str, str]:
    """One in which neither the checkout nor any other program is found."""
    ours = ("PYTHONPATH", "VIRTUAL_ENV", "PYTHONHOME")
    return {**{key: value for key, value in os.environ.items() if key not in ours}, "PATH": ""}


def run(*command: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    words = [str(word) for word in command]
    return subprocess.run(
        words, cwd=cwd, env=environment(), capture_output=True, text=True, check=False
    )


@contextmanager
def viewing(command: Path, out: Path) -> Iterator[str]:
    """Run `stereocell view`, which SIGTERM ends; yields its address."""
    words = [command, "view", out, "--no-browser", "--port", "0"]
    pipe = subprocess.PIPE
    with subprocess.Popen(
        words, cwd=out.parent, env=environment(), stdout=pipe, stderr=pipe, text=True
    ) as view:
        try:
            assert view.stdout is not None
            address, _, told = view.stdout.readline().partition(" shows ")
            assert told, view.communicate(timeout=30)[1]
            yield address.rstrip("/")
            view.send_signal(signal.SIGTERM)
            _, complaints = view.communicate(timeout=30)
            assert (view.returncode, complaints) == (0, "")
        finally:
            view.kill()


def fetch(address: str) -> bytes:
    with urlopen(address, timeout=30) as answer:
        content: bytes = answer.read()
    return content


def take_compiled(kernels: Path) -> None:
    """Give another installation the compiled kernels: to compile them takes half a minute.

    numba knows them by the sources' folder and times; were it otherwise, it would compile anew.
    """
    ours, theirs = ROOT / "pipeline" / "stereocell" / "kernels", kernels / "__pycache__"
    for source in kernels.glob("*.py"):
        shutil.copystat(ours / source.name, source)
    for folder in (ours / "__pycache__").glob("kernels-*/*"):
        if folder.is_dir():
            name = f"kernels_{hashlib.sha1(str(kernels).encode()).hexdigest()}"
            shutil.copytree(folder, theirs / folder.parent.name / name)


def make_wheel(checkout: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder]
    return run(*command, cwd=checkout)


@pytest.mark.slow
def test_a_wheel_alone_builds_and_has_the_viewer(tmp_path: Path) -> None:
    if viewer_dist() is None:
        pytest.skip("the viewer is not built: `make setup`")
    made = make_wheel(ROOT, tmp_path)
    assert made.returncode == 0, made.stderr
    (wheel,) = tmp_path.glob("*.whl")

    # an environment of its own, in which the packages, but not the checkout, are found
    home = tmp_path / "venv"
    venv.create(home, symlinks=True)
    python = home / "bin" / "python"
    (site,) = home.glob("lib/python*/site-packages")
    (site / "packages.pth").write_text(sysconfig.get_path("purelib"))
    uv = [Path(sys.executable).parent / "uv", "pip", "install", "--offline", "--no-deps", "-q"]
    installed = run(*uv, "--python", python, wheel, cwd=tmp_path)
    assert installed.returncode == 0, installed.stderr
    package = Path(
        run(python, "-c", "import stereocell; print(stereocell.__file__)", cwd=tmp_path).stdout
    ).parent
    assert package == site / "stereocell"
    assert (package / "py.typed").is_file()  # PEP 561: who imports it gets its types

    take_compiled(package / "kernels")
    command, out = home / "bin" / "stereocell", tmp_path / "out"
    sample = ["sample", "cycif", "s.ome.zarr", "--grid", "1x1", "--tile-size", "16,48,48"]
    assert run(command, *sample, cwd=tmp_path).returncode == 0
    channel = ["--channels", "CD31", "--workers", "0"]
    built = run(command, "build", "s.ome.zarr", "-o", out, *channel, cwd=tmp_path)
    assert built.returncode == 0, built.stderr
    assert (out / "bundle" / "index.html").is_file()
    assert (out / "report" / "index.html").is_file()
    page = {file.name for file in (package / "viewer_gltf" / "dist").rglob("*") if file.is_file()}
    assert page <= {file.name for file in (out / "bundle").rglob("*")}

    with viewing(command, out) as address:
        shown = fetch(f"{address}/")
        assert shown == (out / "bundle" / "index.html").read_bytes()
        parts = re.findall(r'"(?:packed|plain|style)":"([^"]+)"', shown.decode())
        assert len(parts) == 3  # the code packed and plain, and its style
        for part in parts:
            assert fetch(f"{address}/{part}") == (out / "bundle" / part).read_bytes()

    checked = run(command, "check", out, "--json", cwd=tmp_path)
    lines = json.loads(checked.stdout)["checks"]
    failed = {line["name"]: line["detail"] for line in lines if not line["ok"]}
    assert set(failed) == {"glTF validator", "KTX2 textures"}
    assert all("install Node 20.19" in detail for detail in failed.values())
    if node := shutil.which("node"):  # which is all that the two take
        for script, kind in (("check_glb.mjs", "*.glb"), ("check_ktx2.mjs", "*.ktx2")):
            files = json.dumps([str(file) for file in (out / "bundle").rglob(kind)])
            tool = package / "viewer_gltf" / "tools" / script
            answer = subprocess.run(
                [node, tool], input=files, capture_output=True, text=True, check=True
            )
            found = json.loads(answer.stdout)
            assert found
            assert all(not file["problems"] for file in found)


@pytest.mark.exhaustive
def test_an_sdist_makes_the_same_wheel_without_node(tmp_path: Path) -> None:
    if viewer_dist() is None:
        pytest.skip("the viewer is not built: `make setup`")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", tmp_path]
    made = run(*command, cwd=ROOT)
    assert made.returncode == 0, made.stderr
    (sdist,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        archive.extractall(tmp_path, filter="data")
    unpacked = tmp_path / sdist.name.removesuffix(".tar.gz")
    contents = []
    for checkout in (ROOT, unpacked):
        folder = tmp_path / f"wheel{len(contents)}"
        made = make_wheel(checkout, folder)
        assert made.returncode == 0, made.stderr
        (wheel,) = folder.glob("*.whl")
        with zipfile.ZipFile(wheel) as files:
            contents.append({file.filename: file.CRC for file in files.infolist()})
    assert contents[0] == contents[1]
    assert "stereocell/viewer_gltf/dist/index.html" in contents[0]

    told = Metadata.from_email((unpacked / "PKG-INFO").read_bytes(), validate=True)
    assert told.license_expression == "Apache-2.0"
    assert told.description_content_type == "text/markdown"
    assert "Operating System :: POSIX :: Linux" in told.classifiers


def test_without_the_viewer_there_is_no_wheel(tmp_path: Path) -> None:
    checkout = tmp_path / "checkout"
    for name in ("pyproject.toml", "README.md", "LICENSE", "pipeline/wheel_hook.py"):
        (checkout / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, checkout / name)
    for name in ("pipeline/stereocell", "schemas", "usd_assets", "viewer_gltf/src"):
        (checkout / name).mkdir(parents=True)
    (checkout / "pipeline/stereocell/__init__.py").touch()
    made = make_wheel(checkout, tmp_path)
    assert made.returncode == 1
    (line,) = made.stderr.splitlines() or made.stdout.splitlines()
    assert line == (
        "wheel: viewer_gltf/dist/index.html is missing, expected the built viewer: "
        "run `make wheel`, which builds it first (Node 20.19 or newer)"
    )
    assert not list(tmp_path.glob("*.whl"))
