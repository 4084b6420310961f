"""The wheel alone, installed as in the container: locked wheels, no compiler, no Node.

The steps of deploy/Containerfile make the environment, and its entrypoint runs the commands. Tests
build, check, export and show the smallest sample.
"""

import json
import re
import shutil
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.request import urlopen

import pytest
import trimesh

from stereocell.storage.assets import viewer_dist
from support.container_image import COMPILERS, Image, read_steps
from support.wheel_making import build_package, take_compiled

ROOT = Path(__file__).parents[2]
SAMPLE = ("sample", "cycif", "s.ome.zarr", "--grid", "1x1", "--tile-size", "16,48,48")
BUILD = ("build", "s.ome.zarr", "-o", "out", "--channels", "CD31", "--workers", "0")
LEFT_OUT = "kernels-closing-"  # these kernels are compiled in the environment

pytestmark = pytest.mark.slow


def give_kernels(image: Image) -> None:
    """Give the environment all compiled kernels except one, which the environment compiles."""
    cache = Path(image.variables["NUMBA_CACHE_DIR"])
    take_compiled(image.package / "kernels", cache)
    (left_out,) = cache.glob(f"{LEFT_OUT}*")
    shutil.rmtree(left_out)


def make_context(folder: Path) -> Path:
    """Return the folder that `make wheel` leaves, without the sdist."""
    for lock in ("requirements.lock", "requirements-dev.lock"):
        (folder / lock).symlink_to(ROOT / lock)
    context = Path("out/wheel")
    command = ["make", "-f", str(ROOT / "Makefile"), str(context / "constraints.txt")]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    made = build_package("wheel", ROOT, folder / context)
    assert made.returncode == 0, made.stderr
    return folder / context


@pytest.fixture(scope="module")
def image(tmp_path_factory: pytest.TempPathFactory) -> Image:
    """Carry out deploy/Containerfile; yield the image."""
    if viewer_dist() is None:
        pytest.skip("the viewer is not built: `make setup`")
    folder = tmp_path_factory.mktemp("image")
    (folder / "root").mkdir()
    found = Image(folder / "root", make_context(folder), give_kernels)
    for step in read_steps(ROOT / "deploy" / "Containerfile"):
        found.carry_out(step)
    return found


@pytest.fixture(scope="module")
def out(image: Image) -> Path:
    """A build of the smallest sample in the image."""
    for words in (SAMPLE, BUILD):
        done = image.start(*words)
        assert done.returncode == 0, done.stderr
    assert image.workdir is not None
    return image.workdir / "out"


@contextmanager
def viewing(image: Image, out: Path) -> Iterator[str]:
    """Run `stereocell view`, which SIGTERM ends; yields its address."""
    words = [*image.entrypoint, "view", str(out), "--no-browser", "--port", "0"]
    environment, pipe = image.environment(), subprocess.PIPE
    words[0] = str(shutil.which(words[0], path=environment["PATH"]))
    with subprocess.Popen(words, env=environment, stdout=pipe, stderr=pipe, text=True) as view:
        try:
            assert view.stdout is not None
            address, _, printed = view.stdout.readline().partition(" shows ")
            assert printed, view.communicate(timeout=30)[1]
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


def test_nothing_in_the_environment_can_compile(image: Image) -> None:
    code = (
        "import json, shutil, sys, sysconfig; "
        "names = [*sys.argv[1:], sysconfig.get_config_var('CC').split()[0]]; "
        "print(json.dumps([name for name in names if shutil.which(name)]))"
    )
    found = image.run("python", "-c", code, *COMPILERS)
    assert (found.stdout.strip(), found.stderr) == ("[]", "")


def test_the_wheel_is_complete_and_its_packages_are_those_of_the_lock(image: Image) -> None:
    assert (image.package / "py.typed").is_file()  # PEP 561: importers get the package's types
    code = (
        "import json; from importlib.metadata import distributions; "
        "print(json.dumps({d.name: d.version for d in distributions()}))"
    )
    installed = json.loads(image.run("python", "-c", code).stdout)
    constraints = (image.context / "constraints.txt").read_text("utf-8")
    del installed["stereocell"]
    for name, version in installed.items():
        line = rf"^{re.sub('[-_.]+', '[-_.]+', name)}=={re.escape(version)}( |$)"
        assert re.search(line, constraints, re.MULTILINE | re.IGNORECASE), (name, version)
    assert not {"pytest", "mypy", "pymeshlab"} & installed.keys()


def test_image_runs_as_a_plain_user_and_shares_its_kernels_with_all_users(image: Image) -> None:
    assert not (image.root / "wheel").exists()
    assert image.workdir is not None
    assert image.workdir.stat().st_mode & 0o7777 == 0o1777  # stands in for a mounted folder
    cache = Path(image.variables["NUMBA_CACHE_DIR"])
    compiled = [file for file in cache.rglob("*") if file.is_file()]
    assert any(str(file.relative_to(cache)).startswith(LEFT_OUT) for file in compiled)
    assert all(file.stat().st_mode & 0o006 == 0o006 for file in compiled)
    assert image.user == "1000"
    shown = image.start()
    assert (shown.returncode, shown.stderr) == (0, "")
    assert shown.stdout.startswith("usage: stereocell")


def test_a_sample_is_built_with_the_viewer_and_checked(image: Image, out: Path) -> None:
    assert (out / "report" / "index.html").is_file()
    dist = image.package / "viewer_gltf" / "dist"
    own = {file.relative_to(dist) for file in dist.rglob("*") if file.is_file()}
    inbox = {file for file in own if file.parts[0].startswith("inbox")}
    bundle = {file.relative_to(out / "bundle") for file in (out / "bundle").rglob("*")}
    assert inbox
    assert not inbox & bundle
    assert own - inbox <= bundle
    checked = image.start("check", "out", "--json")
    lines = json.loads(checked.stdout)["checks"]
    failed = {line["name"]: line["detail"] for line in lines if not line["ok"]}
    assert set(failed) == {"glTF validator", "KTX2 textures"}
    assert all("install Node 20.19" in detail for detail in failed.values())


@pytest.mark.skipif(shutil.which("node") is None, reason="no Node for the validators")
@pytest.mark.parametrize(
    ("script", "kind"), [("check_glb.mjs", "*.glb"), ("check_ktx2.mjs", "*.ktx2")]
)
def test_validators_of_the_wheel_need_only_node(
    image: Image, out: Path, script: str, kind: str
) -> None:
    files = json.dumps([str(file) for file in (out / "bundle").rglob(kind)])
    command = [str(shutil.which("node")), str(image.package / "viewer_gltf" / "tools" / script)]
    answer = subprocess.run(command, input=files, capture_output=True, text=True, check=True)
    found = json.loads(answer.stdout)
    assert found
    assert all(not file["problems"] for file in found)


def test_a_glb_is_exported(image: Image, out: Path) -> None:
    done = image.start("export", "out", "cells.glb")
    assert done.returncode == 0, done.stderr
    scene = trimesh.load(out.parent / "cells.glb")
    (mesh,) = scene.geometry.values()
    assert len(mesh.faces) > 100


def test_view_serves_the_page_of_the_bundle(image: Image, out: Path) -> None:
    with viewing(image, out) as address:
        shown = fetch(f"{address}/")
        assert shown == (out / "bundle" / "index.html").read_bytes()
        parts = re.findall(r'"(?:packed|plain|style)":"([^"]+)"', shown.decode())
        assert len(parts) == 3  # packed code, plain code and style
        for part in parts:
            assert fetch(f"{address}/{part}") == (out / "bundle" / part).read_bytes()
