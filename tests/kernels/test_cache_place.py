"""Compiled kernels are cached where possible, compiled once, and again only if code changes."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from stereocell.kernels import cache_place

CALL = """
import numpy as np
from stereocell.kernels import cache_place, compiled, half_edges
print(cache_place.find_home())
print(half_edges.label_vertices(np.zeros((0, 3), np.int32), 2)[1])
print(sum(half_edges.label_vertices.stats.cache_hits.values()))
"""


def call(**environment: str) -> list[str]:
    done = subprocess.run(
        [sys.executable, "-c", CALL],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.split()


@pytest.mark.slow
def test_a_second_process_uses_kernels_that_the_first_compiled(tmp_path: Path) -> None:
    assert call(NUMBA_CACHE_DIR=str(tmp_path)) == [str(tmp_path), "2", "0"]
    assert call(NUMBA_CACHE_DIR=str(tmp_path)) == [str(tmp_path), "2", "1"]


@pytest.mark.slow
def test_kernels_work_where_no_folder_can_be_written(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.touch()  # root may write into any folder, but nobody can create a folder in a file
    assert call(NUMBA_CACHE_DIR=str(blocked)) == ["None", "2", "0"]


def test_the_user_s_cache_is_used_if_the_package_s_folder_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "__pycache__").touch()
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(cache_place, "_HERE", tmp_path)
    assert cache_place.find_home.__wrapped__() == tmp_path / "cache" / "stereocell"


def test_the_folder_s_name_changes_with_a_module_and_the_kernels_it_imports(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for file in cache_place._HERE.glob("*.py"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    monkeypatch.setattr(cache_place, "_HERE", tmp_path)
    monkeypatch.setattr(cache_place, "find_home", lambda: tmp_path)

    def folders() -> dict[str, Path | None]:
        names = ("half_edges", "collapse", "visibility")
        return {name: cache_place.cache_folder.__wrapped__(f"x.{name}") for name in names}

    before = folders()
    changed = tmp_path / "half_edges.py"
    changed.write_text(changed.read_text("utf-8") + "# another\n")
    after = folders()
    assert {name for name in before if before[name] != after[name]} == {"half_edges", "collapse"}
