"""Write docs/licences.md from the metadata of the installed packages: `make licences`.

Each requirement's reason is the comment on its line in pyproject.toml.
"""

import re
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "licences.md"
# Licences of packages whose metadata names none; they stand in the packages' files
UNSTATED = {
    "alktx2": "none stated; it holds Basis Universal, Apache-2.0",
    "hdf5plugin": "MIT; its filters have their own (its file LICENSE)",
    "openexr": "BSD-3-Clause (its file LICENSE.md)",
    "python-dateutil": "BSD-3-Clause; parts since December 2017 also under Apache-2.0",
}
# SPDX identifiers of licences by their names in classifiers
CLASSIFIERS = {
    "Apache Software License": "Apache-2.0",
    "BSD License": "BSD",
    "GNU Lesser General Public License v3 (LGPLv3)": "LGPL-3.0",
    "MIT License": "MIT",
    "Mozilla Public License 2.0 (MPL 2.0)": "MPL-2.0",
    "Python Software Foundation License": "PSF-2.0",
}
_LINE = re.compile(r'^  "(?P<line>[^"]+)", +# (?P<why>.+)$', re.MULTILINE)
_EXTRA = re.compile(r"^(?P<extra>[a-z0-9-]+) = \[.*\] +# (?P<why>.+)$", re.MULTILINE)
_ABOUT = """\
This page lists the licences of all packages that StereoCell uses. `make licences` makes it from
their own metadata.

StereoCell is under Apache-2.0. It contains none of these packages: `pip` installs them beside it,
each under its own licence. No package of an installation without extras is under the GPL; a test
checks that. Packages under the LGPL are used unchanged. JPEG in DICOM is decoded by python-gdcm,
imagecodecs and pylibjpeg-openjpeg."""
_LONGEST = 60  # characters of a licence's name; longer ones are the licence's text


@dataclass(frozen=True, slots=True)
class DirectRequirement:
    """A requirement of StereoCell itself.

    why    the comment on its line in pyproject.toml
    extra  the extra that installs it; empty: every installation has it
    """

    requirement: Requirement
    why: str
    extra: str = ""

    @property
    def name(self) -> str:
        return canonicalize_name(self.requirement.name)


def direct_requirements() -> list[DirectRequirement]:
    """Return the direct requirements with the comments of pyproject.toml, each once."""
    text = (ROOT / "pyproject.toml").read_text("utf-8")
    project = tomllib.loads(text)["project"]
    reasons = {match["line"]: match["why"] for match in _LINE.finditer(text)}
    reasons |= {match["extra"]: match["why"] for match in _EXTRA.finditer(text)}
    found: dict[tuple[str, str], DirectRequirement] = {}
    for extra, lines in {"": project["dependencies"], **project["optional-dependencies"]}.items():
        for line in lines:
            one = DirectRequirement(Requirement(line), reasons.get(extra or line, ""), extra)
            found.setdefault((one.name, extra), one)
    return list(found.values())


def licence_of(name: str) -> str:
    """Return a package's licence as UNSTATED or else its metadata states it."""
    if unstated := UNSTATED.get(canonicalize_name(name)):
        return unstated
    metadata = distribution(name).metadata.json
    if expression := metadata.get("license_expression"):
        return str(expression)
    stated = str(metadata.get("license") or "").strip()
    if stated and len(stated) <= _LONGEST and "\n" not in stated:
        return stated
    classes = metadata.get("classifier", [])
    named = [line.rpartition(" :: ")[2] for line in classes if line.startswith("License :: ")]
    named = [CLASSIFIERS.get(one, one) for one in named if one != "OSI Approved"]
    return " OR ".join(named) or stated.partition("\n")[0]


def is_gpl(licence: str) -> bool:
    """Return whether a licence is the GPL or AGPL, without another licence to choose instead.

    The LGPL does not count, nor does the GPL with GCC's exception, which libraries of compilers
    have.
    """
    alternatives = re.split(r"\s+OR\s+", licence)
    return all(_names_gpl(one) for one in alternatives)


def _names_gpl(licence: str) -> bool:
    bare = re.sub(r"A?GPL[\w.+-]*\s+WITH\s+GCC-exception[\w.-]*", "", licence, flags=re.IGNORECASE)
    words = r"(?<![L\w])A?GPL|(?<!Lesser )(?<!Library )General Public Licen[sc]e"
    return re.search(words, bare) is not None


def closure(requirements: Iterable[Requirement]) -> dict[str, Distribution]:
    """Return the installed packages that the requirements need on this system, direct or not."""
    seen: set[tuple[str, str]] = set()
    found: dict[str, Distribution] = {}
    waiting = [(one, extra) for one in requirements for extra in ("", *one.extras)]
    while waiting:
        one, extra = waiting.pop()
        name = canonicalize_name(one.name)
        if (name, extra) in seen or (one.marker and not one.marker.evaluate({"extra": extra})):
            continue
        seen.add((name, extra))
        try:
            found[name] = distribution(name)
        except PackageNotFoundError:
            continue
        for line in found[name].requires or ():
            more = Requirement(line)
            if more.marker is None or more.marker.evaluate({"extra": extra}):
                bare = Requirement(str(more).partition(";")[0])
                waiting += [(bare, each) for each in ("", *more.extras)]
    return found


def page() -> str:
    """Return the page."""
    return "\n".join(_lines()) + "\n"


def _lines() -> Iterator[str]:
    direct = direct_requirements()
    core = [one for one in direct if not one.extra]
    yield "# Licences"
    yield ""
    yield _ABOUT
    yield ""
    yield "## Packages of every installation"
    yield ""
    yield "| package | licence | why it is there |"
    yield "|---|---|---|"
    for one in core:
        yield f"| {one.name} | {licence_of(one.name)} | {one.why} |"
    yield ""
    yield "## Packages of the extras"
    yield ""
    yield "| package | extra | licence | why it is there |"
    yield "|---|---|---|---|"
    for one in direct:
        if one.extra:
            yield f"| {one.name} | `{one.extra}` | {licence_of(one.name)} | {one.why} |"
    yield ""
    yield "## Packages that these require"
    yield ""
    yield (
        "The packages above bring these with them on Linux, if no extra is installed. Other\n"
        "systems may add a few. Packages that only the extras bring are not listed."
    )
    yield ""
    yield "| package | licence |"
    yield "|---|---|"
    own = {one.name for one in core}
    for name in sorted(closure(one.requirement for one in core)):
        if name not in own:
            yield f"| {name} | {licence_of(name)} |"
    yield ""
    yield "Next: [Install](install.md), or [what an installation takes](installation-size.md)."


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
