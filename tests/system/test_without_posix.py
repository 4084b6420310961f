"""Sample, build with its report, check, export, publish and serve work without what Windows lacks.

No test runs on Windows itself. support/without_posix stands in for it, and states what it hides.
"""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from urllib.request import urlopen

import numpy as np
import pytest
import tifffile

from support import ctrl_c
from support.server.timeouts import PATIENCE_S

HIDING = Path(__file__).parents[1] / "support" / "without_posix"
RUN = """
import json, sys
from stereocell.cli.__main__ import main
for words in json.loads(sys.argv[1]):
    if code := main(words):
        sys.exit(code)
"""


def start(folder: Path, *commands: list[str]) -> subprocess.Popen[str]:
    """Start a process that runs commands one after another, up to the first failure."""
    return subprocess.Popen(
        [sys.executable, "-X", "warn_default_encoding", "-c", RUN, json.dumps(commands)],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(HIDING), "PYTHONIOENCODING": "cp1252"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.slow
def test_commands_run_with_what_windows_has(tmp_path: Path) -> None:
    z, y, x = np.indices((12, 24, 24))
    body = np.where((z - 6) ** 2 + ((y - 12) / 2) ** 2 + ((x - 12) / 2) ** 2 < 12, 200, 20)
    tifffile.imwrite(
        tmp_path / "two.ome.tif",
        np.stack([body, body[:, ::-1]]).astype(np.uint8),
        # a device of Windows, and characters that its file names can't have
        metadata={"axes": "CZYX", "Channel": {"Name": ["NUL", 'a:b? "c".']}},
    )
    with start(
        tmp_path,
        ["sample", "cycif", "s.ome.zarr", "--grid", "1x1", "--tile-size", "8,16,16"],
        ["build", "two.ome.tif", "-o", "out", "--spacing-um", "1,1,1", "--workers", "0"],
        ["check", "out"],
        *(["export", "out", f"a.{ending}"] for ending in ("glb", "3mf", "usdc", "nii.gz")),
        ["export", "out", "a.png", "--width", "200"],
        ["export", "out", "a.precomputed"],
        ["export", "out", "a.precomputed", "--bits", "8"],  # replaces the first export
        ["publish", "out", "site"],
        ["publish", "out", "site"],
    ) as process:
        printed, complaints = process.communicate(timeout=300)
    assert process.returncode == 0, (printed, complaints)
    assert (tmp_path / "site" / "manifest.json").is_file()
    assert printed.endswith("0 uploaded (0 bytes), 0 removed\n")

    with (
        ctrl_c.heeded(),
        start(tmp_path, ["serve", "out", "--port", "0", "--json"]) as server,
    ):
        try:
            assert server.stdout is not None
            line = server.stdout.readline()
            assert line, server.communicate(timeout=PATIENCE_S)[1]
            with urlopen(json.loads(line)["address"], timeout=PATIENCE_S) as answer:
                assert answer.status == 200
            server.send_signal(signal.SIGINT)
            assert server.communicate(timeout=PATIENCE_S)[1] == ""
            assert server.returncode == 0
        finally:
            server.kill()
