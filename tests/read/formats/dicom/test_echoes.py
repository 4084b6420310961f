"""Images of one MR series that differ in echo, angle, time or direction, without Dixon words."""

from itertools import product
from pathlib import Path
from typing import Any

import pydicom
import pytest

from stereocell import read
from support.dicom_kinds import AFFINE, SHAPE, added, write_kind
from support.dicom_series import setting, write_series
from support.exhaustive import sweep

GRADIENT = {"ScanningSequence": "GR", "FlipAngle": 80, "RepetitionTime": 150}
# echo times in ms (opposed phase, in phase) and what the header states
DUAL_ECHOES: dict[str, tuple[float, float, dict[str, Any]]] = {
    "1.5 T": (2.1, 4.4, {**GRADIENT, "MagneticFieldStrength": 1.5}),
    "3 T": (1.15, 2.3, {**GRADIENT, "MagneticFieldStrength": 3.0}),
    "opposed phase last": (6.9, 4.6, {**GRADIENT, "MagneticFieldStrength": 1.5}),
    "no field stated": (2.3, 4.6, {}),
}


@pytest.mark.parametrize(
    ("name", "is_one_series"),
    sweep(
        product(DUAL_ECHOES, (True, False)),
        kept=[*product(DUAL_ECHOES, [True]), (next(iter(DUAL_ECHOES)), False)],
    ),
)
@pytest.mark.slow
def test_the_echo_in_phase_is_built_and_both_are_named(
    tmp_path: Path, name: str, is_one_series: bool
) -> None:
    opposed, in_phase, values = DUAL_ECHOES[name]
    for add, echo in ((200, opposed), (100, in_phase)):
        change = setting(**values, EchoTime=echo)
        if is_one_series:
            write_kind(tmp_path, add, change)
        else:
            write_series(tmp_path / f"{200 - add}", AFFINE, SHAPE, intercept=add, change=change)
    assert [added(tmp_path, number) for number in (1, 2)] == [100, 200]
    lines = read.list_series(tmp_path)
    for line, words in zip(lines, ("in phase by its echo time", "opposed phase by"), strict=True):
        assert words in line
    for line, echo in zip(lines, (in_phase, opposed), strict=True):
        assert f"echo time {echo:g} ms" in line
    notes = "\n".join(read.open(tmp_path).notes)
    assert "in phase by its echo time" in notes
    assert f"opposed phase by its echo time, echo time {opposed:g} ms" in notes


@pytest.mark.parametrize(
    ("echoes", "values"),
    [
        ((12, 80), {"ScanningSequence": "SE", "MagneticFieldStrength": 1.5}),
        ((2.3, 4.6), {"ScanningSequence": ["SE", "EP"], "MagneticFieldStrength": 1.5}),
        ((4.6, 9.2), {**GRADIENT, "MagneticFieldStrength": 1.5}),  # both in phase
        ((5.0, 20.0), {}),
    ],
)
def test_other_echoes_have_no_name_of_a_phase_and_the_first_is_built(
    tmp_path: Path, echoes: tuple[float, float], values: dict[str, Any]
) -> None:
    for add, echo in zip((100, 200), echoes, strict=True):
        write_kind(tmp_path, add, setting(**values, EchoTime=echo))
    assert added(tmp_path) == 100
    assert "phase" not in "".join(read.list_series(tmp_path))


@pytest.mark.parametrize("order", ["slices first", "times first"])
@pytest.mark.slow
def test_trigger_times_that_change_with_the_heart_rate_are_time_points(
    tmp_path: Path, order: str
) -> None:
    for time in range(3):

        def change(ds: pydicom.Dataset, time: int = time) -> None:
            place = ds.InstanceNumber - 1
            ds.TriggerTime = 50.0 * time + 7 * place
            # the order of instance numbers must not decide
            ds.InstanceNumber = (
                1 + 3 * place + 2 - time if order == "times first" else 40 - 10 * time + place
            )

        write_kind(tmp_path, 100 * (time + 1), change)
    assert [added(tmp_path, time=time) for time in range(3)] == [100, 200, 300]
    assert not any("InstanceNumber" in note for note in read.open(tmp_path).notes)


def test_directions_of_diffusion_are_named(tmp_path: Path) -> None:
    for number in range(3):
        change = setting(DiffusionBValue=1000.0, AcquisitionNumber=number + 1)
        write_kind(tmp_path, 100 * (number + 1), change, first_number=1 + 10 * number)
    dataset = read.open(tmp_path)
    assert dataset.time_points == 3
    note = "3 images at a place are directions of diffusion (they differ in AcquisitionNumber)"
    assert any(note in one for one in dataset.notes)


@pytest.mark.slow
def test_repetition_times_are_named_and_in_rising_order(tmp_path: Path) -> None:
    for add, ms in ((200, 500), (300, 2000), (100, 100)):
        write_kind(tmp_path, add, setting(RepetitionTime=ms), first_number=add)
    assert [added(tmp_path, time=time) for time in range(3)] == [100, 200, 300]
    note = "3 images at a place are repetition times (they differ in RepetitionTime)"
    assert any(note in one for one in read.open(tmp_path).notes)
