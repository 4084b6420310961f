"""The page of licences names every requirement, and no installation takes a package of the GPL."""

import re
import tomllib
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def licences() -> ModuleType:
    """docs/licences.py, as `make licences` runs it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "docs"))
        return import_module("licences")


def project() -> tuple[list[Requirement], dict[str, list[Requirement]]]:
    """Return the requirements of every installation, and those of each extra."""
    found = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    extras = found["optional-dependencies"].items()
    return [*map(Requirement, found["dependencies"])], {
        extra: [*map(Requirement, lines)] for extra, lines in extras
    }


def test_no_package_of_an_installation_without_extras_is_under_the_gpl(
    licences: ModuleType,
) -> None:
    found = licences.closure(project()[0])
    assert {"numpy", "pillow", "llvmlite", "botocore"} <= found.keys()  # indirect ones, too
    assert len(found) > 80
    assert [name for name in found if licences.is_gpl(licences.licence_of(name))] == []


def test_packages_of_the_gpl_are_found_among_the_extras(licences: ModuleType) -> None:
    of_extras = [one for lines in project()[1].values() for one in lines]
    names = {canonicalize_name(one.name) for one in of_extras}
    assert {name for name in names if licences.is_gpl(licences.licence_of(name))} == {"pymeshlab"}


@pytest.mark.parametrize(
    ("licence", "is_gpl"),
    [
        ("GPL-3.0-or-later", True),
        ("GPLv2+", True),
        ("GPL3", True),
        ("AGPL-3.0", True),
        ("GNU General Public License v3 (GPLv3)", True),
        ("BSD-3-Clause AND GPL-2.0-only", True),
        ("GPL-2.0-only OR MIT", False),
        ("LGPL-3.0-or-later", False),
        ("GNU Lesser General Public License v3 (LGPLv3)", False),
        ("BSD-3-Clause AND GPL-3.0-or-later WITH GCC-exception-3.1", False),
        ("MIT", False),
    ],
)
def test_the_gpl_is_distinguished_from_the_lgpl_and_from_a_choice(
    licences: ModuleType, licence: str, is_gpl: bool
) -> None:
    assert licences.is_gpl(licence) == is_gpl


def test_the_page_names_all_requirements_with_their_reasons(licences: ModuleType) -> None:
    page = (ROOT / "docs" / "licences.md").read_text("utf-8")
    parts = dict(zip(["", "core", "extras", "others"], page.split("\n## "), strict=True))
    core, extras = project()
    rows = re.findall(r"^\| ([a-z0-9-]+) \| (.+) \| (.+) \|$", parts["core"], re.MULTILINE)
    assert {row[0] for row in rows if row[0] != "package"} == {
        canonicalize_name(one.name) for one in core
    }
    of_extras = re.findall(r"^\| ([a-z0-9-]+) \| `(.+)` \| (.+) \| (.+) \|$", page, re.MULTILINE)
    assert {(name, extra) for name, extra, *_ in of_extras} == {
        (canonicalize_name(one.name), extra) for extra, lines in extras.items() for one in lines
    }
    for one in licences.direct_requirements():
        assert one.why, f"pyproject.toml: {one.name}: expected a comment that says why it is there"
        assert f" | {one.why} |" in page, f"{one.name}: run `make licences`"
        assert licences.licence_of(one.name)
