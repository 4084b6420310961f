"""The importer and the player keep the memory of volumes in Unity within the budget.

The stub of Unity's textures adds up the bytes of all textures, in main memory and on the GPU.
"""

import json
import struct
import subprocess
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

Run = Callable[..., subprocess.CompletedProcess[bytes]]

MB = 1e6
TILES, CHANNELS = 10, 3  # numbers of the paper's scene
PAPER = [[512, 512, 194], [256, 256, 97], [128, 128, 48]]  # x, y, z of the levels of its tiles
OPTIONS = {"mostTexels": 256, "budget": 40}


def ask(run: Run, *args: object, **how: Any) -> Any:
    done = run(*args, **how)
    assert done.returncode == 0, done.stderr.decode()
    return json.loads(done.stdout)


def level(run: Run, *boxes: tuple[list[list[int]], int], **options: float) -> Any:
    asked = [{"levels": levels, "channels": channels} for levels, channels in boxes]
    return ask(run, "level", json.dumps({"boxes": asked, "options": {**OPTIONS, **options}}))


def test_a_tile_of_the_paper_s_scene_takes_less_than_40_mb(run: Run) -> None:
    found = level(run, (PAPER, CHANNELS))
    assert found["level"] == 1
    assert found["textures"] == 4 * 256 * 256 * 97  # RGBA
    assert TILES * found["textures"] / MB == pytest.approx(254, abs=1)  # if all tiles were kept
    assert found["peak"] < 40 * MB


def test_a_coarser_level_is_chosen_if_memory_is_short(run: Run) -> None:
    assert level(run, (PAPER, 1), mostTexels=512, budget=60)["level"] == 0
    assert level(run, (PAPER, 1), mostTexels=512, budget=40)["level"] == 1
    assert level(run, (PAPER, 3), budget=20)["level"] == 2
    assert level(run, (PAPER, 3), budget=1)["level"] == 2  # the coarsest level, if none fits
    # More than four channels take several boxes, which count together.
    assert level(run, (PAPER, 4), (PAPER, 1))["level"] == 1
    assert level(run, (PAPER, 4), (PAPER, 4))["level"] == 2


@pytest.mark.slow
def test_only_the_tile_that_was_looked_at_stays_in_memory(run: Run) -> None:
    asked = {"size": PAPER[1], "channels": CHANNELS, "tiles": TILES, "budget": 40, "slices": True}
    found = ask(run, "tour", json.dumps(asked))
    assert found["errors"] == []
    texture = 4 * 256 * 256 * 97
    names = [f"tile{i}" for i in range(TILES)]
    for name, step in zip(names, found["steps"], strict=True):
        assert step["showing"] == [name]
        assert step["surfaces"] == [each for each in names if each != name]
        assert step["loading"]  # the surfaces stayed until the voxels were loaded
        assert step["held"] == texture
        # A frame uploads at most 2 MB and one more slice.
        assert 0 < step["mostInFrame"] <= (2 << 20) + 4 * 256 * 256
        assert step["resident"] == found["peak"] < 40 * MB
    assert texture < found["most"] <= found["peak"]
    assert found["most"] < 40 * MB
    # The last tile's voxels have the value 10 + channel; the fourth component is empty.
    assert found["sums"] == [(10 + c) * 256 * 256 * 97 for c in range(3)] + [0]


@pytest.mark.slow
def test_a_gpu_that_cannot_copy_slices_needs_one_texture_more(run: Run) -> None:
    asked = {"size": [64, 48, 20], "channels": 2, "tiles": 2, "budget": 2, "slices": False}
    found = ask(run, "tour", json.dumps(asked))
    texture = 2 * 64 * 48 * 20
    assert found["errors"] == []
    assert [step["held"] for step in found["steps"]] == [texture, 2 * texture]  # both tiles fit
    assert found["most"] == 3 * texture
    assert found["sums"] == [(2 + c) * 64 * 48 * 20 for c in range(2)]


@pytest.mark.slow
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_tiles_stay_while_they_fit(run: Run, channels: int) -> None:
    size = [40, 30, 20]
    asked = {"size": size, "channels": channels, "tiles": 4, "budget": 40, "slices": True}
    found = ask(run, "tour", json.dumps(asked))
    stride = {1: 1, 2: 2, 3: 4, 4: 4}[channels]
    assert [len(step["showing"]) for step in found["steps"]] == [1, 2, 3, 4]
    assert found["reloaded"]  # after the GPU has lost a texture
    assert found["steps"][-1]["held"] == 4 * stride * 40 * 30 * 20
    assert found["sums"] == [((4 + c) if c < channels else 0) * 24000 for c in range(stride)]


def test_the_least_recently_requested_items_leave_first(run: Run) -> None:
    wanted = [["a", 40], ["b", 40], ["a", 40], ["c", 30], ["d", 200], ["a", 10]]
    assert ask(run, "residency", json.dumps(wanted)) == [
        [[], ["a"], 40],
        [[], ["a", "b"], 80],
        [[], ["b", "a"], 80],
        [["b"], ["a", "c"], 70],
        [["a", "c"], ["d"], 200],  # one item stays, however large it is
        [["d"], ["a"], 10],
    ]


def test_a_player_on_android_copies_the_voxel_file_out_once(run: Run, tmp_path: Path) -> None:
    inside = tmp_path / "apk" / "StereoCell"
    inside.mkdir(parents=True)
    (inside / "a.volume").write_bytes(b"voxels")
    address = f"jar:file://{tmp_path / 'apk'}"
    looks = ask(run, "place", address, "a.volume", project=tmp_path)
    copied = "cache/StereoCell/a.volume"
    assert [path for path, _ in looks] == [None, None, copied, copied]
    assert (tmp_path / copied).read_bytes() == b"voxels"
    assert ask(run, "place", address, "a.volume", project=tmp_path)[0] == [copied, None]
    path, error = ask(run, "place", address, "gone.volume", project=tmp_path)[-1]
    assert path is None
    assert "gone.volume: 404" in error
    assert ask(run, "place", "/data/assets", "a.volume")[0] == [
        "/data/assets/StereoCell/a.volume",
        None,
    ]


def volume_file(volumes: NDArray[np.uint8]) -> bytes:
    """Return a voxel file in the documented format, from voxels (channels, z, y, x)."""
    channels, depth, height, width = volumes.shape
    head = b"SCV1" + struct.pack("<4i", width, height, depth, channels)
    packed = zlib.compressobj(wbits=-15)
    planes = volumes.transpose(1, 0, 2, 3).tobytes()
    return head + packed.compress(planes) + packed.flush()


@pytest.mark.parametrize("channels", [1, 2, 3])
def test_voxel_files_written_with_zlib_are_read(run: Run, tmp_path: Path, channels: int) -> None:
    volumes = np.random.default_rng(4).integers(0, 256, (channels, 5, 6, 7), np.uint8)
    (tmp_path / "a.volume").write_bytes(volume_file(volumes))
    found = run("voxels", tmp_path / "a.volume")
    stride = {1: 1, 2: 2, 3: 4}[channels]
    texels = np.zeros((5, 6, 7, stride), np.uint8)
    texels[..., :channels] = volumes.transpose(1, 2, 3, 0)
    assert found.stdout == texels.tobytes()


@pytest.mark.parametrize(
    ("spoil", "expected"),
    [
        (lambda data: data[:-8], "ends after slice"),
        (lambda data: b"SCV2" + data[4:], "found another file"),
        (lambda data: data[:4] + b"\xff" * 16 + data[20:], "size is damaged"),
        (lambda data: data[:10], "found another file"),
    ],
)
def test_damaged_voxel_files_are_refused_in_one_line(
    run: Run, tmp_path: Path, spoil: Callable[[bytes], bytes], expected: str
) -> None:
    volumes = np.random.default_rng(5).integers(0, 256, (2, 5, 6, 7), np.uint8)
    (tmp_path / "a.volume").write_bytes(spoil(volume_file(volumes)))
    done = run("voxels", tmp_path / "a.volume")
    assert done.returncode == 1
    assert expected in done.stderr.decode()
    assert done.stderr.count(b"\n") == 1
