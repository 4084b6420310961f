"""The page on clusters begins with a warning, and its commands make a cluster with TLS."""

import json
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import date, timedelta
from pathlib import Path

import pytest

from support.clusters import wait_for_scheduler

PAGE = (Path(__file__).parents[2] / "docs" / "cluster.md").read_text("utf-8")
_CALL = (
    "import json, os, sys; from distributed import Client; "
    "address = json.load(open(sys.argv[1]))['address']; "
    "print(Client(address, timeout=5).run_on_scheduler(os.getpid))"
)


def block(kind: str, number: int) -> str:
    return re.findall(rf"^```{kind}\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)[number]


def words_of(command: str, folder: Path) -> list[str]:
    """Return a command of the page, with this Python, a folder for /shared and a day to come."""
    line = command.split("     #")[0].replace("/shared", str(folder))
    line = re.sub(r"\d{4}-\d\d-\d\d", str(date.today() + timedelta(days=30)), line)
    first, *others = shlex.split(line)
    return {"dask": [sys.executable, "-m", "dask"], "python": [sys.executable]}.get(
        first, [first]
    ) + others


@contextmanager
def scheduler_of_the_page(folder: Path) -> Iterator[str]:
    """Make the certificates, and start the scheduler. Yield the file of Dask's configuration."""
    for command in block("sh", 0).splitlines():
        subprocess.run(words_of(command, folder), check=True, capture_output=True)
    file = folder / "tls" / "dask.yaml"
    file.write_text(block("yaml", 0).replace("/shared", str(folder)), "utf-8")
    export, scheduler, *_ = block("sh", 1).splitlines()
    assert export.split("     #")[0] == "export DASK_CONFIG=/shared/tls/dask.yaml"
    process = subprocess.Popen(
        [*words_of(scheduler, folder), "--port", "0", "--host", "127.0.0.1"],
        env={**os.environ, "DASK_CONFIG": str(file)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        wait_for_scheduler(folder / "scheduler.json")
        yield str(file)
    finally:
        process.kill()
        process.wait()


def test_the_page_begins_with_the_warning() -> None:
    assert PAGE.startswith(
        "# Clusters\n\n> **Everybody who can reach a Dask scheduler's port can "
        "run any code as you**"
    )
    commands = [line for line in PAGE.splitlines() if line.startswith(("dask ", "stereocell "))]
    assert "--protocol tls" in commands[0]


@pytest.mark.slow
def test_the_cluster_of_the_page_admits_only_clients_with_the_key(tmp_path: Path) -> None:
    folder = tmp_path / "shared"
    folder.mkdir()
    with scheduler_of_the_page(folder) as config:
        file = folder / "scheduler.json"
        assert json.loads(file.read_text("utf-8"))["address"].startswith("tls://127.0.0.1:")
        call = [sys.executable, "-c", _CALL, str(file)]
        friend = {**os.environ, "DASK_CONFIG": config}
        admitted = subprocess.run(call, env=friend, capture_output=True, text=True, check=True)
        assert admitted.stdout.strip().isdigit()
        stranger = {name: value for name, value in os.environ.items() if "DASK" not in name}
        refused = subprocess.run(call, env=stranger, capture_output=True, text=True, check=False)
        assert (refused.returncode, refused.stdout) == (1, "")
