"""All cases, in a fixed order."""

from malformed import (
    array_cases,
    build_cases,
    dicom_cases,
    nifti_cases,
    object_cases,
    plane_cases,
    settings_cases,
    tiff_cases,
    usd_cases,
    zarr_cases,
)
from malformed.cases import Case

MODULES = (
    zarr_cases, tiff_cases, plane_cases, nifti_cases, dicom_cases, array_cases, settings_cases,
    build_cases, usd_cases, object_cases,
)  # fmt: skip


def all_cases() -> list[Case]:
    found = [case for module in MODULES for case in module.cases()]
    keys = [(case.kind, case.name) for case in found]
    assert len(set(keys)) == len(keys), {k for k in keys if keys.count(k) > 1}
    return found


def one_of_each_kind(cases: list[Case]) -> list[Case]:
    """Return the middle case of each kind."""
    kinds = dict.fromkeys(case.kind for case in cases)
    of_kinds = [[case for case in cases if case.kind == kind] for kind in kinds]
    return [some[len(some) // 2] for some in of_kinds]


def sample(cases: list[Case], count: int) -> list[Case]:
    """Return `count` of the cases, spread evenly."""
    return [cases[i * len(cases) // count] for i in range(min(count, len(cases)))]
