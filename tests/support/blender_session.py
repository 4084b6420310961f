"""Run steps of tests/blender/session.py in headless Blender, which `make test-blender` installs."""

import atexit
import json
import os
import re
import subprocess
import tempfile
from functools import cache
from itertools import count
from pathlib import Path
from select import select
from typing import Any

import pytest

PYTHON = os.environ.get("STEREOCELL_BLENDER", "")
NEEDS_BLENDER = [
    pytest.mark.slow,
    pytest.mark.skipif(not PYTHON, reason="needs Blender's Python: run `make test-blender`"),
]
_SESSION = Path(__file__).parents[1] / "blender" / "session.py"
_turns = count()


@cache
def blender() -> subprocess.Popen[str]:
    """Start Blender, which runs step after step until this process ends."""
    folder = tempfile.TemporaryDirectory()  # in it, each step leaves a folder that Blender makes
    atexit.register(folder.cleanup)
    process = subprocess.Popen(
        [PYTHON, str(_SESSION)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "TMPDIR": folder.name},
    )
    atexit.register(process.communicate)
    return process


def run(step: str, folder: Path, **arguments: Any) -> Any:
    """Run one step in an unused Blender, and return its findings."""
    turn = next(_turns)
    result, file = folder / f"result{turn}.json", folder / f"arguments{turn}.json"
    file.write_text(json.dumps({**arguments, "result": str(result)}, default=str))
    process = blender()
    assert process.stdin is not None
    assert process.stdout is not None
    print(json.dumps({"step": step, "arguments": str(file)}), file=process.stdin, flush=True)
    if not select([process.stdout], [], [], 300)[0]:
        process.kill()
        blender.cache_clear()  # the next step gets a new Blender
        pytest.fail(f"{step}: no end after 300 s")
    code = process.stdout.readline().strip()
    printed = Path(f"{result}.txt").read_text("utf-8")
    assert code == "0", printed[-3000:]
    found = json.loads(result.read_text("utf-8"))
    # Blender prints the report of an operator like this
    messages = re.findall(r"^(Info|Warning): (\d+ edits: .*)$", printed, re.MULTILINE)
    return {**found, "messages": messages} if step.startswith("edit") else found
