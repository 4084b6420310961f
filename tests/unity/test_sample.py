"""The scene of the Cardboard sample works with an imported specimen, frame by frame."""

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

Run = Callable[..., subprocess.CompletedProcess[bytes]]


@pytest.mark.slow
def test_gaze_fills_the_reticle_switches_a_tile_and_the_button_switches_it_back(
    run: Run, bundle: Path
) -> None:
    done = run("sample", bundle)
    assert done.returncode == 0, done.stderr.decode()
    found = json.loads(done.stdout)
    filled = found["filled"]  # filled ones of 48 segments, for each frame at 64 Hz
    assert filled[0] == 0
    assert filled[48] == 24
    assert filled[95] == round(48 * 95 / 96)
    assert filled[:96] == sorted(filled[:96])
    assert found["afterDwell"]
    assert not found["afterButton"]
    assert not found["afterRest"]  # after the button, the dwell does not fire for the same tile
    assert found["scans"] == 1  # the QR code of an unknown Cardboard viewer is scanned
    assert found["steps"] <= 100
    assert found["camera"] == "MainCamera"
