"""Each command takes the outputs of other commands, or states in one line what it expects."""

from collections.abc import Callable
from pathlib import Path

import pytest

from stereocell.cli import commands
from stereocell.cli.__main__ import COMMANDS, main
from stereocell.cli.places import PLACES
from stereocell.serve.server import BundleServer
from support.outputs import Outputs, make_outputs

pytestmark = pytest.mark.slow

VOLUMES = {"the sample mri", "the sample brain-cells", "exported .nrrd", "exported .nii.gz"}
BUNDLES = {"a build", "OUT/bundle", "a published page"}
# For each command, the words with which it gets an output, and the outputs that it accepts
GIVEN: dict[str, tuple[Callable[[Path, Path], list[object]], set[str]]] = {
    "build": (lambda given, new: ["build", given, "-o", new], VOLUMES),
    "plan": (lambda given, new: ["plan", given, "-o", new], VOLUMES),
    "slices": (lambda given, new: ["slices", given, "-o", new, "--channels", "0"], VOLUMES),
    "iso": (
        lambda given, new: ["iso", given, "-o", f"{new}.png", "--channel", "0", "--tile", "r0_c0"],
        VOLUMES,
    ),
    **{
        name: (lambda given, _, name=name: [name, given], {"a build"})  # type: ignore[misc]
        for name in ("units", "stage", "bundle", "report", "tissue")
    },
    "export": (lambda given, new: ["export", given, f"{new}.usda"], {"a build"}),
    "publish": (lambda given, new: ["publish", given, new], BUNDLES),
    "check": (lambda given, _: ["check", given], BUNDLES | {"exported .html"}),
    "view": (lambda given, _: ["view", given, "--no-browser", "--port", "0"], BUNDLES | VOLUMES),
    "serve": (lambda given, _: ["serve", given, "--port", "0"], BUNDLES | VOLUMES),
}
NOT_GIVEN = {"sample", "doctor", "settings"}  # commands without an input


@pytest.fixture(scope="module")
def outputs(tmp_path_factory: pytest.TempPathFactory) -> Outputs:
    return make_outputs(tmp_path_factory.mktemp("outputs"))


def test_every_command_is_tried() -> None:
    assert GIVEN.keys() | NOT_GIVEN == COMMANDS.keys() == PLACES.keys()


@pytest.mark.parametrize("command", GIVEN)
def test_command_accepts_each_output_or_refuses_it_in_one_line(
    outputs: Outputs,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    command: str,
) -> None:
    monkeypatch.setattr(BundleServer, "run", lambda server: server._socket.close())
    if command == "build":  # planning reads the input, and the other phases take long
        monkeypatch.setattr(commands, "_run_phases", lambda *_: commands.Answer(dict.fromkeys(
            ("stage", "bundle", "report"), "")))  # fmt: skip
    if command == "tissue":
        monkeypatch.setattr("stereocell.building.tissue.add_tissue", lambda *_: None)
    arguments, taken = GIVEN[command]
    found = {}
    for number, (name, path) in enumerate(outputs.paths.items()):
        capfd.readouterr()
        words = [str(word) for word in arguments(path, tmp_path / f"new {number}")]
        found[name] = main(words)
        printed = capfd.readouterr().err
        assert "Traceback" not in printed
        if found[name]:
            (line,) = [line for line in printed.splitlines() if line.startswith("stereocell: ")]
            assert str(path) in line
            assert "expected" in line or "run `stereocell" in line
    assert {name for name, code in found.items() if code == 0} == taken
