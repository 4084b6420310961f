"""The series that is built without `--series` is the one that a physician expects."""

from pathlib import Path

import pytest

from stereocell import read
from stereocell.cli.__main__ import main
from support.dicom_kinds import AFFINE, SHAPE, added, image_type, write_kind
from support.dicom_series import setting, write_series

DIXON = {
    "Siemens": ("OPP_PHASE", "FAT", "WATER", "IN_PHASE"),
    "Philips": ("OP", "F", "W", "IP"),
    "words in full": ("OPPOSED_PHASE", "FAT", "WATER", "INPHASE"),
}


@pytest.mark.parametrize("maker", DIXON)
@pytest.mark.slow
def test_dixon_images_are_in_phase_then_water_then_opposed_phase_then_fat(
    tmp_path: Path, maker: str
) -> None:
    for add, word in zip((300, 400, 200, 100), DIXON[maker], strict=True):
        write_kind(tmp_path, add, image_type("M", word), first_number=1000 - add)
    assert [added(tmp_path, number) for number in (1, 2, 3, 4)] == [100, 200, 300, 400]
    assert added(tmp_path) == 100


def test_the_opposed_phase_does_not_precede_the_phase_by_echo_time(tmp_path: Path) -> None:
    for add, word, echo in ((200, "OPP_PHASE", 1.23), (100, "IN_PHASE", 2.46)):
        change = setting(ImageType=["ORIGINAL", "PRIMARY", "M", word], EchoTime=echo)
        write_kind(tmp_path, add, change)
    assert (added(tmp_path), added(tmp_path, 2)) == (100, 200)


def test_derived_water_comes_before_an_original_opposed_phase(tmp_path: Path) -> None:
    write_kind(tmp_path, 200, image_type("M", "OPP_PHASE"))
    water = setting(ImageType=["DERIVED", "PRIMARY", "DIXON", "WATER"])
    write_kind(tmp_path, 100, water, first_number=50)
    assert (added(tmp_path), added(tmp_path, 2)) == (100, 200)


@pytest.mark.slow
def test_dixon_images_in_separate_series_have_the_same_order(tmp_path: Path) -> None:
    for name, word, intercept in (("a", "FAT", 2), ("b", "OPP_PHASE", 3), ("c", "IN_PHASE", 1)):
        change = image_type("M", word)
        write_series(tmp_path / name, AFFINE, SHAPE, intercept=intercept, change=change)
    lines = read.list_series(tmp_path)
    assert [line.split(", ")[2] for line in lines] == ["in phase", "opposed phase", "fat"]
    assert [added(tmp_path, number) for number in (1, 2, 3)] == [1, 3, 2]


def test_a_fat_fraction_map_comes_after_the_images(tmp_path: Path) -> None:
    write_kind(tmp_path, 200, setting(ImageType=["DERIVED", "PRIMARY", "FF", "FF"]))
    write_kind(tmp_path, 100, image_type("M", "FAT"), first_number=50)
    assert added(tmp_path) == 100
    assert "parametric map" in read.list_series(tmp_path)[1]


@pytest.mark.slow
def test_the_uniform_image_comes_before_both_inversions(tmp_path: Path) -> None:
    for add, word, time in ((300, "INV1", 700), (200, "INV2", 2500), (100, "UNI", 5000)):
        change = setting(ImageType=["ORIGINAL", "PRIMARY", "M", word], InversionTime=time)
        write_kind(tmp_path, add, change)
    assert [added(tmp_path, number) for number in (1, 2, 3)] == [100, 200, 300]


def test_a_soft_kernel_comes_before_one_that_sharpens(tmp_path: Path) -> None:
    for add, kernel in ((200, "BONE"), (100, "STANDARD")):
        write_kind(tmp_path, add, setting(ConvolutionKernel=kernel), modality="CT")
    assert (added(tmp_path), added(tmp_path, 2)) == (100, 200)


def test_pet_without_attenuation_correction_is_a_separate_series(tmp_path: Path) -> None:
    for add, words in ((200, ["DECY", "RAN"]), (100, ["DECY", "ATTN", "SCAT"])):
        write_kind(tmp_path, add, setting(Modality="PT", CorrectedImage=words), first_number=add)
    assert (added(tmp_path), added(tmp_path, 2)) == (100, 200)
    dataset = read.open(tmp_path)
    assert dataset.time_points == 1
    assert any("(not attenuation corrected)" in note for note in dataset.notes)


def test_the_list_states_its_order(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for add, word in ((200, "FAT"), (100, "WATER")):
        write_kind(tmp_path / "in", add, image_type("M", word))
    command = ["plan", str(tmp_path / "in"), "-o", str(tmp_path / "out"), "--series", "list"]
    assert main(command) == 0
    last = capsys.readouterr().out.splitlines()[-1]
    assert last.startswith("order: images before phases")
    assert "in phase and water before opposed phase and fat" in last
