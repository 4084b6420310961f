"""The Cardboard sample: its scene is made around an imported specimen and run frame by frame."""

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
    filled = found["filled"]  # of 48 segments, frame by frame at 64 Hz
    assert filled[0] == 0
    assert filled[48] == 24
    assert filled[95] == round(48 * 95 / 96)
    assert filled[:96] == sorted(filled[:96])
    assert found["afterDwell"]
    assert not found["afterButton"]
    assert not found["afterRest"]  # the button is no reason to dwell on
    assert found["scans"] == 1  # of the viewer's QR code, where it is not known
    assert found["steps"] <= 100
    assert found["camera"] == "MainCamera"
