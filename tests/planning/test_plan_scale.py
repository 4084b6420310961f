"""The plan of a whole CyCIF dataset: 22 x 11 tiles and 70 channels, 16 940 units."""

import cProfile
import pstats
from pathlib import Path

import pytest
import zarr

from stereocell.building.out_folder import OutFolder
from stereocell.cli.__main__ import main
from support import phantoms

SHAPE, TILE = (194, 5508, 10908), (194, 512, 512)
CALLS_BY_UNIT = 200  # most calls of functions for each unit; it was 153, with imports


def write_empty(path: Path, channels: int) -> Path:
    """Write an OME-Zarr of SHAPE that stores only one of its chunks."""
    labels = [{"label": f"stain {n}", "color": "FF0000"} for n in range(channels)]
    phantoms.write_ome_zarr(
        path, [phantoms.f_phantom()[None]], "czyx", version="0.4", channels=labels
    )
    array = zarr.create_array(
        path / "0",
        shape=(channels, *SHAPE),
        chunks=(1, *TILE),
        dtype="uint16",
        zarr_format=2,
        chunk_key_encoding={"name": "v2", "separator": "/"},
        overwrite=True,
    )
    array[0, 0, 0, 0] = 1
    return path


@pytest.mark.slow
def test_the_plan_of_16940_units_takes_few_calls_for_each_unit(tmp_path: Path) -> None:
    """Calls are counted and not seconds, which depend on other work of the machine."""
    source = write_empty(tmp_path / "whole.ome.zarr", 70)
    size = ",".join(map(str, TILE))
    flags = ["--preset", "cycif", "--level", "0", "--tile-size", size]
    with cProfile.Profile() as counted:
        assert main(["plan", str(source), "-o", str(tmp_path / "out"), *flags]) == 0
    plan = OutFolder(tmp_path / "out").plan()
    assert (len(plan.tiles), len(plan.channels)) == (242, 70)
    calls = pstats.Stats(counted).total_calls
    assert calls < CALLS_BY_UNIT * 16940
