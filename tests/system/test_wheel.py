"""Building the wheel and the sdist; test_empty_environment.py installs the wheel."""

import shutil
import tarfile
import zipfile
from pathlib import Path

import pytest
from packaging.metadata import Metadata

from stereocell.storage.assets import viewer_dist
from support.wheel_making import build_package

ROOT = Path(__file__).parents[2]


@pytest.mark.exhaustive
def test_an_sdist_makes_the_same_wheel_without_node(tmp_path: Path) -> None:
    if viewer_dist() is None:
        pytest.skip("the viewer is not built: `make setup`")
    made = build_package("sdist", ROOT, tmp_path)
    assert made.returncode == 0, made.stderr
    (sdist,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        archive.extractall(tmp_path, filter="data")
    unpacked = tmp_path / sdist.name.removesuffix(".tar.gz")
    contents = []
    for checkout in (ROOT, unpacked):
        folder = tmp_path / f"wheel{len(contents)}"
        made = build_package("wheel", checkout, folder)
        assert made.returncode == 0, made.stderr
        (wheel,) = folder.glob("*.whl")
        with zipfile.ZipFile(wheel) as files:
            contents.append({file.filename: file.CRC for file in files.infolist()})
    assert contents[0] == contents[1]
    assert "stereocell/viewer_gltf/dist/index.html" in contents[0]

    metadata = Metadata.from_email((unpacked / "PKG-INFO").read_bytes(), validate=True)
    assert metadata.license_expression == "Apache-2.0"
    assert metadata.description_content_type == "text/markdown"
    assert "Operating System :: POSIX :: Linux" in metadata.classifiers


def test_wheel_is_not_built_without_the_viewer(tmp_path: Path) -> None:
    checkout = tmp_path / "checkout"
    for name in ("pyproject.toml", "README.md", "LICENSE", "pipeline/wheel_hook.py"):
        (checkout / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, checkout / name)
    for name in ("pipeline/stereocell", "schemas", "usd_assets", "viewer_gltf/src"):
        (checkout / name).mkdir(parents=True)
    (checkout / "pipeline/stereocell/__init__.py").touch()
    made = build_package("wheel", checkout, tmp_path)
    assert made.returncode == 1
    (line,) = made.stderr.splitlines() or made.stdout.splitlines()
    assert line == (
        "wheel: viewer_gltf/dist/index.html is missing, expected the built viewer. "
        "Run `make wheel`, which builds it first (Node 20.19 or newer)."
    )
    assert not list(tmp_path.glob("*.whl"))
