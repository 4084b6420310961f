"""Files of deploy/ agree with the package, and name only versions of Python that are tested.

Tests have no container engine. test_empty_environment.py carries out the Containerfile's steps.
"""

import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import yaml
from packaging.requirements import Requirement

from stereocell.cli.__main__ import COMMANDS
from support.container_image import read_steps

ROOT = Path(__file__).parents[2]
DEPLOY = ROOT / "deploy"
# Packages that have another name on conda-forge
CONDA = {
    "dask": "dask-core",  # `distributed` brings the rest of dask
    "libigl": "igl",
    "matplotlib": "matplotlib-base",
    "openexr": "openexr-python",
    "python-gdcm": "gdcm",
    "usd-core": "openusd",
    "vtk": "vtk-base",
}
LINUX = {"sys_platform": "linux", "platform_machine": "x86_64"}
# Hosts of package registries. No file may name them, because users set their own.
REGISTRIES = re.compile(
    r"pypi\.org|pythonhosted\.org|npmjs\.(org|com)|yarnpkg\.com|anaconda\.(org|com)|crates\.io"
    r"|proxy\.golang\.org|rubygems\.org|nuget\.org|jsdelivr\.net|unpkg\.com"
)


def project() -> dict[str, Any]:
    found: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    return found


def test_conda_recipe_has_the_requirements_of_the_package() -> None:
    recipe = yaml.safe_load((DEPLOY / "conda" / "recipe.yaml").read_text("utf-8"))
    python, *asked = recipe["requirements"]["run"]
    assert python.startswith("python >=")
    # A recipe has no markers. For Macs with an Intel processor, conda builds packages of its own.
    wanted = [
        one
        for one in map(Requirement, project()["dependencies"])
        if one.marker is None or one.marker.evaluate(LINUX)
    ]
    assert {(one.name, one.specifier) for one in map(Requirement, asked)} == {
        (CONDA.get(one.name, one.name), one.specifier) for one in wanted
    }
    assert len(asked) == len(wanted)
    assert recipe["context"]["version"] == project()["version"]
    assert recipe["about"]["summary"] == project()["description"]
    (script,) = project()["scripts"].items()
    assert recipe["build"]["python"]["entry_points"] == [" = ".join(script)]


def test_table_of_sizes_states_the_true_users_of_requirements() -> None:
    page = (ROOT / "docs" / "installation-size.md").read_text("utf-8")
    rows = dict(re.findall(r"^\| ([a-z0-9-]+) \| \d+ \| \d+ \| (.*) \|$", page, re.MULTILINE))
    assert rows.keys() <= {Requirement(line).name for line in project()["dependencies"]}
    assert len(rows) > 15
    package = ROOT / "pipeline" / "stereocell"
    for name, module, folder, of in (
        ("scikit-learn", "sklearn", "tissue", "`tissue` alone"),
        ("trustme", "trustme", "serve", "`serve --lan`, `view --lan`"),
    ):
        users = {
            file.relative_to(package).parts[0]
            for file in package.rglob("*.py")
            if re.search(rf"^\s*(from|import) {module}\b", file.read_text("utf-8"), re.MULTILINE)
        }
        assert (users, rows[name]) == ({folder}, of)
    extras = set(re.findall(r"^\| `([a-z0-9-]+)` \| (?:below )?\d+ \|$", page, re.MULTILINE))
    assert extras == project()["optional-dependencies"].keys()


def test_the_services_of_compose_are_commands_that_exist() -> None:
    compose = yaml.safe_load((DEPLOY / "compose.yaml").read_text("utf-8"))
    services = compose["services"]
    assert services["worker"]["deploy"]["replicas"] == 2
    for name in ("scheduler", "worker"):
        program, command, *words = services[name]["entrypoint"]
        printed = subprocess.run(
            [sys.executable, "-m", program, command, "--help"],
            capture_output=True, text=True, check=True,
        ).stdout  # fmt: skip
        for flag in (word for word in words if word.startswith("--")):
            assert re.search(rf"{flag}\b", printed), f"dask {command}: {flag}"
    # A program that reaches the scheduler can run code in the workers, so no port is published.
    assert all("ports" not in service for service in services.values())
    # All services see the store and the input under the same names.
    ours = [services[name] for name in ("scheduler", "worker", "stereocell")]
    assert all(one["environment"] == ours[0]["environment"] for one in ours)
    assert all(one["volumes"] == ours[0]["volumes"] for one in ours)
    endpoint = ours[0]["environment"]["AWS_ENDPOINT_URL"]
    port = re.fullmatch(r"http://store:(\d+)", endpoint)
    assert port is not None
    assert f"--port :{port[1]} " in str(services["store"])
    for secret in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"):
        assert ours[0]["environment"][secret] in str(services["store"])


def test_commands_in_comments_are_those_of_the_package() -> None:
    text = (DEPLOY / "compose.yaml").read_text("utf-8").split("x-stereocell")[0]
    shown = re.findall(r"run --rm stereocell(?: \\\n#)?\s+(\w+)", text)
    assert shown == ["build", "check"]
    assert set(shown) <= COMMANDS.keys()


def test_all_files_name_only_versions_of_python_that_are_tested() -> None:
    prefix = "Programming Language :: Python :: 3."
    minors = {
        one.removeprefix(prefix) for one in project()["classifiers"] if one.startswith(prefix)
    }
    tested = {f"3.{minor}" for minor in minors}
    assert project()["requires-python"].removeprefix(">=") in tested
    base, *_ = read_steps(DEPLOY / "Containerfile")
    image = re.fullmatch(r"docker\.io/library/python:([\d.]+)-slim", base.text)
    assert base.instruction == "FROM"
    assert image is not None
    assert image[1] in tested
    workflow = (ROOT / "docs" / "examples" / "check-bundle.yml").read_text("utf-8")
    (of_workflow,) = re.findall(r'python-version: "([\d.]+)"', workflow)
    assert of_workflow in tested
    # CI runs a short test with the newest version.
    newest = max(tested, key=lambda version: int(version.removeprefix("3.")))
    assert f"\nNEWEST := {newest}\n" in (ROOT / "Makefile").read_text("utf-8")
    assert "test-newest" in (ROOT / ".ci" / "run").read_text("utf-8")
    table = (ROOT / "docs" / "systems.md").read_text("utf-8")
    assert set(re.findall(r"^\| Linux, x86-64, Python ([\d.]+) \|", table, re.MULTILINE)) == tested
    # The image has no compiler, so it installs wheels only.
    assert "--only-binary :all:" in (DEPLOY / "Containerfile").read_text("utf-8")


def test_no_page_or_file_names_the_host_of_a_package_registry() -> None:
    folders = [ROOT / name for name in ("deploy", "docs", "tests", "pipeline", "schemas")]
    files = [file for folder in folders for file in folder.rglob("*") if file.is_file()]
    files += [file for file in ROOT.iterdir() if file.is_file()]
    texts = {".cfg", ".json", ".lock", ".md", ".mjs", ".py", ".toml", ".txt", ".yaml", ".yml", ""}
    read = [file for file in files if file.suffix in texts and "__pycache__" not in file.parts]
    assert {"recipe.yaml", "Containerfile", "install.md", "Makefile"} <= {f.name for f in read}
    for file in read:
        found = REGISTRIES.search(file.read_text("utf-8", errors="replace"))
        assert found is None, f"{file.relative_to(ROOT)}: names {found and found[0]}"
