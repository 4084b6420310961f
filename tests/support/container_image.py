"""A Containerfile's steps, carried out in a folder that stands for the root of the image.

There is no container engine. Paths in the steps are moved below that folder, and the Python of the
tests stands for the image's. Packages come from uv's cache, as wheels and in the versions of
requirements.lock, so neither a network nor a compiler is used.
"""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
UV = Path(sys.executable).with_name("uv")
COMPILERS = (
    "cc",
    "c++",
    "gcc",
    "g++",
    "clang",
    "clang++",
    "c89",
    "c99",
    "tcc",
    "icx",
    "nvcc",
    "cl",
)
# all programs that the steps call besides Python and pip
PROGRAMS = ("sh", "mkdir", "rm", "chmod")
PIP = """#!/bin/sh
for word do shift; [ "$word" = --no-cache-dir ] || set -- "$@" "$word"; done
exec {uv} pip "$@" --offline --quiet --only-binary :all: --constraint {lock} --python {python}
"""


@dataclass(frozen=True)
class Step:
    """One instruction: `RUN`, and its text on a single line."""

    instruction: str
    text: str


def read_steps(containerfile: Path) -> list[Step]:
    """Return the instructions in order, without comments."""
    lines = [
        line
        for line in containerfile.read_text("utf-8").splitlines()
        if line.strip() and not line.lstrip().startswith("#")
    ]
    joined = "\n".join(lines).replace("\\\n", " ")
    return [
        Step(instruction, " ".join(text.split()))
        for instruction, _, text in (line.partition(" ") for line in joined.splitlines())
    ]


@dataclass
class Image:
    """The image after the steps so far; `after_install` is called once packages are installed."""

    root: Path
    context: Path  # the folder that COPY reads
    after_install: Callable[["Image"], None]
    variables: dict[str, str] = field(default_factory=dict)
    base: str = ""
    user: str = "root"
    workdir: Path | None = None
    entrypoint: list[str] = field(default_factory=list)
    command: list[str] = field(default_factory=list)

    @property
    def venv(self) -> Path:
        return self.root / "venv"

    @property
    def package(self) -> Path:
        """The installed package."""
        (found,) = self.venv.glob("lib/python*/site-packages/stereocell")
        return found

    def environment(self) -> dict[str, str]:
        """The image's environment: only its own programs are found, and compilers fail."""
        ours = ("PYTHONPATH", "VIRTUAL_ENV", "PYTHONHOME", "NUMBA_CACHE_DIR", "PYTHONWARNINGS")
        inherited = {name: value for name, value in os.environ.items() if name not in ours}
        path = f"{self.venv / 'bin'}:{self.root / 'programs'}"
        none = "/bin/false"
        return {**inherited, **self.variables, "PATH": path, "CC": none, "CXX": none, "CI": ""}

    def run(self, *words: object) -> subprocess.CompletedProcess[str]:
        """Run a command in the image's working folder."""
        command = [str(word) for word in words]
        return subprocess.run(
            command,
            cwd=self.workdir or self.root,
            env=self.environment(),
            capture_output=True,
            text=True,
            check=False,
        )

    def start(self, *words: object) -> subprocess.CompletedProcess[str]:
        """Run the entrypoint, with its default command if there are no words."""
        return self.run(*self.entrypoint, *(words or self.command))

    def carry_out(self, step: Step) -> None:
        """Carry out an instruction. Skips the test if a wheel is not in uv's cache."""
        match step.instruction:
            case "FROM":
                self.base = step.text
                self._make_environment()
            case "ENV":
                name, _, value = step.text.partition("=")
                self.variables[name] = self._inside(value)
            case "COPY":
                *patterns, target = step.text.split()
                folder = Path(self._inside(target))
                folder.mkdir(parents=True)
                for pattern in patterns:
                    files = sorted(self.context.glob(pattern))
                    assert files, f"COPY {pattern}: `make wheel` leaves no such file"
                    for file in files:
                        shutil.copy2(file, folder)
            case "RUN":
                for line in step.text.split(" && "):
                    self._run_line(self._inside(line))
            case "USER":
                self.user = step.text
            case "WORKDIR":
                self.workdir = Path(self._inside(step.text))
            case "ENTRYPOINT":
                self.entrypoint = json.loads(step.text)
            case "CMD":
                self.command = json.loads(step.text)
            case other:
                raise ValueError(f"Containerfile has {other}, which this test can't carry out")

    def _make_environment(self) -> None:
        subprocess.run([UV, "venv", "-q", "--python", sys.executable, self.venv], check=True)
        (self.root / "tmp").mkdir()
        programs = self.root / "programs"
        programs.mkdir()
        for name in PROGRAMS:
            (programs / name).symlink_to(shutil.which(name) or f"/bin/{name}")
        words = {"uv": UV, "lock": ROOT / "requirements.lock", "python": self.venv / "bin/python"}
        quoted = {name: shlex.quote(str(path)) for name, path in words.items()}
        (programs / "pip").write_text(PIP.format(**quoted))
        (programs / "pip").chmod(0o755)

    def _run_line(self, line: str) -> None:
        done = self.run("sh", "-c", line)
        if done.returncode and re.search(
            r"network was disabled|Network connectivity is disabled", done.stderr
        ):
            version = ".".join(map(str, sys.version_info[:2]))
            pytest.skip(f"uv's cache lacks wheels that requirements.lock has for Python {version}")
        assert done.returncode == 0, f"{line}: {done.stderr}"
        if line.startswith("pip install"):
            self.after_install(self)

    def _inside(self, text: str) -> str:
        """Move absolute paths below the folder of the image."""
        return re.sub(r'(?<![^\s"=])/(?=\w)', f"{self.root}/", text)
