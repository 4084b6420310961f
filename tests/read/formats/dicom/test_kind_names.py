"""Kernels and image types are named with known words, and free text in them is not shown."""

from pathlib import Path

import pytest

from stereocell import read
from support.dicom_kinds import AFFINE, SHAPE, added, write_kind
from support.dicom_series import Change, setting, write_series


def names_of_two(folder: Path, first: Change, second: Change, modality: str = "MR") -> list[str]:
    """Return the names of two kinds of one series, in the order of the list."""
    write_kind(folder, 100, first, modality=modality)
    write_kind(folder, 300, second, modality=modality, first_number=30)
    return [line.split("  ")[2].split(", axial")[0] for line in read.list_series(folder)]


def kernel(*values: str) -> Change:
    return setting(ConvolutionKernel=list(values))


@pytest.mark.parametrize(
    ("first", "second", "names"),
    [
        (("Br59d", "3"), ("Br40d", "3"), ["kernel Br40d 3", "kernel Br59d 3"]),
        (("Br40d", "2"), ("Br40d", "3"), ["kernel Br40d 2", "kernel Br40d 3"]),
        (("I70f", "2"), ("I30f", "2"), ["kernel I30f 2", "kernel I70f 2"]),
        (("LUNG", "ASIR"), ("STANDARD", "ASIR"), ["kernel STANDARD", "kernel LUNG"]),
        (("B30f", "JANE"), ("B30f", "DOE"), ["kernel B30f no. 1", "kernel B30f no. 2"]),
        (("JANE", "3"), ("DOE", "3"), ["kernel no. 1", "kernel no. 2"]),
    ],
)
def test_a_kernel_of_several_values_is_named_by_those_that_are_codes(
    tmp_path: Path, first: tuple[str, ...], second: tuple[str, ...], names: list[str]
) -> None:
    found = names_of_two(tmp_path, kernel(*first), kernel(*second), modality="CT")
    assert found == [f"CT, {name}" for name in names]


def test_kernels_of_several_values_name_separate_series(tmp_path: Path) -> None:
    for number, code in enumerate(("Br59d", "Br40d")):
        series = f"1.2.{number}"
        write_series(tmp_path / code, AFFINE, SHAPE, series=series, modality="CT",
                     change=kernel(code, "3"))  # fmt: skip
    lines = read.list_series(tmp_path)
    assert ["kernel Br40d 3" in lines[0], "kernel Br59d 3" in lines[1]] == [True, True]


@pytest.mark.parametrize(
    ("first", "second", "names"),
    [
        (("DERIVED", "M", "SWI"), ("ORIGINAL", "M", "ND"), ["original", "susceptibility-weighted"]),
        (("ORIGINAL", "M", "NORM"), ("ORIGINAL", "M", "ND"),
         ["original", "original, intensity-normalized"]),
        (("ORIGINAL", "M", "WATER", "DIS2D"), ("ORIGINAL", "M", "WATER"),
         ["water", "water, distortion-corrected"]),
        (("ORIGINAL", "M", "JANE"), ("ORIGINAL", "M", "DOE"), ["original no. 1", "original no. 2"]),
    ],
)  # fmt: skip
def test_image_types_are_named_with_documented_words(
    tmp_path: Path, first: tuple[str, ...], second: tuple[str, ...], names: list[str]
) -> None:
    types = [setting(ImageType=[word[0], "PRIMARY", *word[1:]]) for word in (first, second)]
    found = names_of_two(tmp_path, *types)
    assert found == [f"MR, magnitude, {name}" for name in names]


def test_the_magnitude_precedes_the_susceptibility_weighted_image(tmp_path: Path) -> None:
    weighted = setting(ImageType=["DERIVED", "PRIMARY", "M", "SWI"])
    names_of_two(tmp_path, weighted, setting(ImageType=["ORIGINAL", "PRIMARY", "M", "ND"]))
    assert [added(tmp_path), added(tmp_path, series=2)] == [300, 100]
