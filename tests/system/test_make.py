"""`make` passes variables on unchanged: a name with a quote stays a name and never runs."""

import os
import re
import shutil
import subprocess
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from stereocell.cli.__main__ import main
from support.exhaustive import sweep
from support.server.timeouts import PATIENCE_S

ROOT = Path(__file__).parents[2]
LOCKS = ("requirements.lock", "requirements-dev.lock")
NAMES = (
    "plain", "two words", "it's", 'say "x"', "a$b", "$HOME", "$(HOME)", "$(touch pwned)",
    "$(shell touch pwned)", "`touch pwned`", "a; touch pwned", "a & touch pwned", "a | b > c",
    "a#b", "50%", "a:b", "a\nb", "a\n\ttouch pwned", "-n", "--help", "a\\b", "a\\", "*", "~",
    "a,b", "(", ")", "a=b", "a\tb ", "Gr\u00f6\u00dfe",
)  # fmt: skip
# One of each kind: quote, expansion, end of a command, mark of a rule, line break, flag
KEPT = ("it's", "$(shell touch pwned)", "a; touch pwned", "50%", "a:b", "a\n\ttouch pwned", "-n")
FAKE = r"""#!/bin/sh
{ for word; do printf '%s\0' "$word"; done; printf '\1'; } >> calls
for out; do :; done
case "$1" in
  plan | build) for word; do case "$word" in --out=*) out="${word#--out=}" ;; esac; done ;;
esac
make_file() { mkdir -p -- "$out/$1" && touch -- "$out/$1/$2"; }
case "$1" in
  plan) make_file . plan.json ;;
  units) make_file units done.json ;;
  stage) make_file stage stage.usda ;;
  bundle) make_file bundle manifest.json ;;
  report) make_file report index.html ;;
  build) make_file stage a; make_file bundle a; make_file report a ;;
esac
"""
# Make counts these files as up to date, so that it sets nothing up.
READY = ("-o .venv/.ready -o .venv/.ready-dev -o .venv/.kernels "
         "-o viewer_gltf/dist/index.html")  # fmt: skip
Make = Callable[..., subprocess.CompletedProcess[str]]

pytestmark = pytest.mark.skipif(shutil.which("make") is None, reason="no make")


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A checkout in a folder with a hard name; its command is the script FAKE."""
    folder = tmp_path / 'it\'s a "$(touch pwned)" check out'
    folder.mkdir()
    for name in ("Makefile", "pipeline", "schemas", ".venv"):
        (folder / name).symlink_to(ROOT / name)
    (folder / "fake").write_text(FAKE)
    (folder / "fake").chmod(0o755)
    return folder


@pytest.fixture
def make(checkout: Path) -> Make:
    """Run make with variables, by name, in the checkout, which counts as set up."""
    ours = ("MAKE", "MFLAGS", "INPUT", "OUT", "SAMPLE", "WORKERS", "ARGS", "CI", "RUN")

    def run(
        *words: str, environment: dict[str, str] | None = None, **set_: str
    ) -> subprocess.CompletedProcess[str]:
        inherited = {k: v for k, v in os.environ.items() if not k.startswith(ours)}
        set_ = {"RUN": "./fake", **set_}
        return subprocess.run(
            ["make", *READY.split(), *words, *(f"{name}={value}" for name, value in set_.items())],
            cwd=checkout,
            env={**inherited, **(environment or {})},
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
        )

    return run


def calls(checkout: Path) -> list[list[str]]:
    """Return the words of each call of FAKE since this function was last called."""
    file = checkout / "calls"
    text = file.read_text("utf-8") if file.exists() else ""
    file.unlink(missing_ok=True)
    return [call.split("\0")[:-1] for call in text.split("\1")[:-1]]


def phases(source: str, out: str) -> list[list[str]]:
    later = [[phase, "--workers=3", "--", out] for phase in ("units", "stage", "bundle", "report")]
    return [["plan", f"--out={out}", "--", source], *later]


@pytest.mark.parametrize("name", sweep(NAMES, kept=KEPT))
def test_phases_pass_names_on_unchanged_and_only_unfinished_phases_run(
    checkout: Path, make: Make, name: str
) -> None:
    source, out = name, f"{name}.out"
    (checkout / source).write_text("")
    set_ = {"INPUT": source, "OUT": out, "WORKERS": "3"}
    before = {path.name for path in checkout.iterdir()}
    made = make("report", **set_)
    assert (made.returncode, made.stderr) == (0, "")
    assert calls(checkout) == phases(source, out)
    assert {path.name for path in checkout.iterdir()} == before | {out, "out"}

    again = make("report", **set_)
    assert (again.returncode, calls(checkout)) == (0, [])
    assert "fake" not in make("-n", "report", **set_).stdout
    (checkout / out / "stage" / "stage.usda").unlink()
    assert [phase in make("-n", "report", **set_).stdout for phase in ("units", "stage")] == [
        False,
        True,
    ]
    make("stage", **set_)
    assert calls(checkout) == phases(source, out)[2:3]
    # Variables may come from the environment. With other ARGS the plan is made again.
    del set_["WORKERS"]
    make("plan", environment={**set_, "ARGS": "--grid 2x1"})
    assert calls(checkout) == [["plan", f"--out={out}", "--grid", "2x1", "--", source]]

    for target, words in (("check", ["check"]), ("view", ["view"]), ("serve", ["serve", "--lan"])):
        make(target, OUT=out, ARGS="--lan")
        assert calls(checkout) == [[*words, "--", out]]
    assert not list(checkout.parent.rglob("pwned"))


@pytest.mark.parametrize("name", sweep(NAMES, kept=KEPT))
def test_variables_reach_a_nested_make_unchanged(checkout: Path, make: Make, name: str) -> None:
    (checkout / "outer.mk").write_text(f"include Makefile\nagain:\n\t$(MAKE) {READY} serve\n")
    assert make("-f", "outer.mk", "again", OUT=name, ARGS="--lan").returncode == 0
    assert calls(checkout) == [["serve", "--lan", "--", name]]
    assert not (checkout / "pwned").exists()


@pytest.mark.parametrize("name", sweep(NAMES, kept=KEPT))
def test_demo_passes_names_on_unchanged(checkout: Path, make: Make, name: str) -> None:
    set_ = {"OUT": name, "WORKERS": name, "ARGS": "--grid 1x1", "SAMPLE": "mri"}
    made = make("demo", MAKE=f"make {READY}", **set_)
    assert (made.returncode, made.stderr) == (0, "")
    sampled, built, checked = calls(checkout)
    place = "out/samples/head"
    assert sampled == ["sample", "mri", place]
    assert built == [
        *("build", place, f"--out={name}", f"--workers={name}", "--preset", "mri"),
        *("--grid", "1x1"),
    ]
    assert checked == ["check", "--deep", f"--workers={name}", "--", name]
    printed = made.stdout.splitlines()[-1] if "\n" not in name else ""
    if printed:
        shown = printed.partition("OUT=")[2]
        echoed = subprocess.run(
            ["bash", "-c", f"printf %s {shown}"], capture_output=True, text=True, check=True
        )
        assert echoed.stdout == name
    assert not (checkout / "pwned").exists()


@pytest.mark.parametrize("name", sweep(NAMES, kept=KEPT))
def test_t_must_be_a_folder_of_tests(checkout: Path, make: Make, name: str) -> None:
    (checkout / "tests" / name).mkdir(parents=True)
    made = make("test-here", T=name, PYTEST="./fake")
    assert (made.returncode, made.stderr) == (0, "")
    assert calls(checkout) == [["-m", "not slow", f"tests/{name}"]]
    refused = make("test-here", T=f"no {name}", PYTEST="./fake")
    assert refused.returncode == 2
    assert refused.stderr.startswith(f"T is no {name}, expected a folder of tests or of viewer")
    assert calls(checkout) == []
    assert not list(checkout.parent.rglob("pwned"))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('--config "my file.toml"', ["--config", "my file.toml"]),
        ("--config 'it\"s' a\\ b", ["--config", 'it"s', "a b"]),
        ("$(touch pwned) `touch pwned`", ["$(touch", "pwned)", "`touch", "pwned`"]),
        ("$(shell touch pwned)", ["$(shell", "touch", "pwned)"]),
        ("a; touch pwned & # $HOME *", ["a;", "touch", "pwned", "&", "#", "$HOME", "*"]),
        ("a\nb\tc", ["a", "b", "c"]),
        ("", []),
        ("ARGS ''", ["ARGS", ""]),
    ],
)
def test_args_are_split_like_shell_words_and_not_run(
    checkout: Path, make: Make, text: str, words: list[str]
) -> None:
    assert make("plan", INPUT="ARGS", OUT="o", ARGS=text).returncode == 0
    assert calls(checkout) == [["plan", "--out=o", *words, "--", "ARGS"]]
    assert not (checkout / "pwned").exists()


def test_another_request_for_the_same_out_is_planned_again(checkout: Path, make: Make) -> None:
    for name in ("a", "a b"):
        (checkout / name).touch()
    for source, text in (("a", "b c"), ("a b", "c"), ("a b", "")):
        make("plan", INPUT=source, OUT="o", ARGS=text)
        make("plan", INPUT=source, OUT="o", ARGS=text)
        assert calls(checkout) == [["plan", "--out=o", *text.split(), "--", source]]
    os.utime(checkout / "a b", (2e9, 2e9))  # the source is newer than its plan
    assert "plan" in make("-n", "plan", INPUT="a b", OUT="o").stdout


def test_impossible_variables_are_named_in_one_line(checkout: Path, make: Make) -> None:
    for set_, expected in (
        ({"INPUT": "a", "ARGS": 'say "x'}, 'ARGS is say "x (No closing quotation), expected words'),
        ({}, "INPUT is not set, expected INPUT=volume.ome.zarr OUT=folder"),
        ({"INPUT": "a", "OUT": ""}, "OUT is empty, expected OUT=folder"),
        ({"SAMPLE": "%"}, "SAMPLE is %, expected cycif, brain-cells, mri or cells"),
        ({"SAMPLE": "cycif mri"}, "SAMPLE is cycif mri, expected"),
        ({"SAMPLE": "$(shell touch pwned)"}, "SAMPLE is $(shell touch pwned), expected"),
    ):
        refused = make("plan", **set_)
        assert refused.returncode == 2
        assert expected in refused.stderr
        assert calls(checkout) == []
    assert not (checkout / "pwned").exists()


def test_programs_and_folders_may_have_hard_names(checkout: Path, make: Make) -> None:
    name = 'it\'s $(touch pwned) "py"; x'
    (checkout / name).write_text("#!/bin/sh\necho Python 3.9\nexit 1\n")
    (checkout / name).chmod(0o755)
    for file in (*LOCKS, "pyproject.toml"):
        (checkout / file).touch()
    refused = make("none/.ready", VENV="none", PYTHON=f"./{name}")
    assert refused.stderr.splitlines()[0] == (
        f"setup: ./{name} is Python 3.9, expected 3.11 or newer (PYTHON=... names another)"
    )
    assert make("browser", CHROMIUM=name).stdout == ""
    show = checkout / "show"
    show.write_text('#!/bin/sh\nprintf %s "$STEREOCELL_DATA-$CHROMIUM" > shown\n')
    show.chmod(0o755)
    make("check", RUN="./show", STEREOCELL_DATA=name, CHROMIUM="$(HOME)")
    assert (checkout / "shown").read_text("utf-8") == f"{name}-$(HOME)"
    assert not (checkout / "pwned").exists()


def test_each_version_of_python_has_its_own_environment(checkout: Path, make: Make) -> None:
    name = 'it\'s $(touch pwned) "py"; x'
    (checkout / ".venv").unlink()

    def environment(version: str) -> str:
        (checkout / name).write_text(f"#!/bin/sh\necho {version}\n")
        (checkout / name).chmod(0o755)
        made = make("--eval=show:; @echo $(VENV)", "show", PYTHON=f"./{name}")
        assert (made.returncode, made.stderr) == (0, "")
        return made.stdout.strip()

    assert environment("3.13") == ".venv"  # no environment exists yet
    (checkout / ".venv" / "lib" / "python3.13").mkdir(parents=True)
    assert [environment(version) for version in ("3.13", "3.12", "3.9")] == [
        ".venv",
        ".venv-3.12",
        ".venv-3.9",
    ]
    made = make("--eval=show:; @echo $(VENV)", "show", PYTHON="python3")
    assert made.stdout.strip() == ".venv"  # the default takes any existing environment
    for file in (*LOCKS, "pyproject.toml"):
        (checkout / file).touch()
    refused = make("setup", PYTHON="./missing")
    assert refused.stderr.splitlines()[0] == (
        "setup: ./missing is not installed, expected 3.11 or newer (PYTHON=... names another)"
    )
    assert not list(checkout.glob(".venv-*"))
    assert not (checkout / "pwned").exists()


def test_the_newest_python_is_found_in_pyenv_or_reported_as_missing(
    checkout: Path, make: Make
) -> None:
    for name in (*LOCKS, "pyproject.toml", "viewer_gltf"):
        (checkout / name).symlink_to(ROOT / name)
    set_: dict[str, Any] = {"NEWEST": "3.99", "environment": {"PYENV_ROOT": str(checkout)}}
    missing = make("test-newest", **set_)
    expected = "test-newest: skipped: python3.99 is not installed\n"
    assert (missing.returncode, missing.stdout, missing.stderr) == (0, expected, "")
    python = checkout / "versions" / "3.99.1" / "bin" / "python3.99"
    python.parent.mkdir(parents=True)
    python.write_text("#!/bin/sh\necho 3.99\n")
    python.chmod(0o755)
    found = make("-n", "test-newest", **set_)
    assert (found.returncode, found.stderr) == (0, "")
    assert ".venv-3.99/bin/pytest" in found.stdout
    assert not list(checkout.parent.rglob("pwned"))


def test_the_two_locks_agree_and_users_get_no_developers_packages() -> None:
    entry = re.compile(r"^([\w.-]+)==(\S+)(?: ; (.*))? \\$", re.MULTILINE)
    users, developers = (entry.findall((ROOT / lock).read_text("utf-8")) for lock in LOCKS)
    names = {name for name, *_ in users}
    # A package stands in both files only if developers need it on more systems.
    assert {one for one in developers if one[0] in names} & set(users) == set()
    assert {one[:2] for one in developers if one[0] in names} <= {one[:2] for one in users}
    groups = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["dependency-groups"]
    asked = {
        canonicalize_name(Requirement(line).name) for line in groups["dev"] if isinstance(line, str)
    }
    assert {"mypy", "pytest", "ruff"} <= asked - names
    assert {canonicalize_name(Requirement(line).name) for line in groups["setup"]} <= names
    assert asked <= names | {name for name, *_ in developers}


@pytest.mark.slow
def test_build_with_hard_names(
    checkout: Path, make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The program gets make's words in this process, because five new processes take seconds."""
    source, out = "it's $(touch pwned); 100%.ome.zarr", '-my "out": `touch pwned` #1'
    sample = ["sample", "cycif", str(checkout / source), "--grid", "1x1"]
    assert main([*sample, "--tile-size", "16,48,48"]) == 0
    (checkout / "my settings.toml").write_text('[plan]\nchannels = ["CD31"]\n')
    set_ = {"INPUT": source, "OUT": out, "WORKERS": "0"}
    set_["ARGS"] = '--config "my settings.toml"'
    made = make("bundle", **set_)
    assert made.returncode == 0, made.stderr
    phases_ = calls(checkout)
    assert [words[0] for words in phases_] == ["plan", "units", "stage", "bundle"]
    shutil.rmtree(checkout / out)
    monkeypatch.chdir(checkout)
    assert [main(words) for words in phases_] == [0, 0, 0, 0]
    assert (checkout / out / "bundle" / "manifest.json").is_file()
    assert "make: Nothing to be done" in make("bundle", **set_).stdout
    assert make("check", **set_).returncode == 0
    (given,) = calls(checkout)
    assert given[0] == "check"
    assert main(given) == 0
    assert not list(checkout.glob("pwned"))
