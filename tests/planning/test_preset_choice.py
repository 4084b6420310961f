"""The preset that is chosen if the user names none, and the plan's notes on it."""

import re
from pathlib import Path

import nibabel
import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.building.out_folder import OutFolder
from stereocell.cli.__main__ import main
from stereocell.planning.channels import SKIN
from stereocell.planning.ct_evidence import LEVELS_HU, WINDOW_HU
from stereocell.planning.preset_choice import choose_preset, load_for
from stereocell.planning.settings import load
from stereocell.read.open_dataset import open as open_dataset
from support import phantoms

SHAPE = (24, 30, 32)


def _body(air: float, tissue: float) -> NDArray[np.int16]:
    z, y, x = np.indices(SHAPE)
    away = np.sqrt((z - 12) ** 2 + (y - 15) ** 2 + (x - 16) ** 2)
    noise = np.random.default_rng(0).normal(0, 4, SHAPE)
    return (np.where(away < 9, tissue, air) + noise).round().astype(np.int16)


def _nifti(path: Path, voxels: NDArray[np.generic], spacing_mm: float = 1.0) -> Path:
    image = nibabel.Nifti1Image(voxels, np.diag([*(spacing_mm,) * 3, 1.0]))
    image.header.set_xyzt_units("mm")
    nibabel.save(image, path)
    return path


def test_voxels_of_millimetres_with_hounsfield_units_are_a_ct(tmp_path: Path) -> None:
    source = _nifti(tmp_path / "a b.nii.gz", _body(-1000, 40))
    chosen, reason = choose_preset(open_dataset(source))
    assert chosen == "ct"
    assert "1 mm" in reason[0]
    assert "Hounsfield" in reason[0]


def test_voxels_of_millimetres_without_hounsfield_units_are_an_mri(tmp_path: Path) -> None:
    chosen, reason = choose_preset(open_dataset(_nifti(tmp_path / "a.nii", _body(20, 400))))
    assert chosen == "mri"
    assert "no Hounsfield units" in reason[0]


@pytest.mark.parametrize(
    ("voxels", "words", "level", "window"),
    [
        (_body(24, 1064), "Hounsfield units plus 1024", (724, 724), "0:3024"),
        (_body(24, 1064).clip(0).astype(np.uint16), "plus 1024", (724, 724), "0:3024"),
        (_body(20, 180).astype(np.uint8), "8-bit values, which are no Hounsfield", (40, 160), ""),
    ],
    ids=["offset 1024", "offset without a sign", "8 bits"],
)
def test_a_ct_of_other_values_is_taken_for_mr_and_the_flags_for_a_ct_are_printed(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    voxels: NDArray[np.int16],
    words: str,
    level: tuple[float, float],
    window: str,
) -> None:
    source = _nifti(tmp_path / "a.nii", voxels)
    chosen, (assumed, advice) = choose_preset(open_dataset(source))
    assert chosen == "mri"
    assert words in assumed + advice
    assert "no modality is stated: MR is assumed (or --preset none for the defaults)" in assumed
    assert "for a CT --preset ct --iso-value 0=" in advice
    assert ("no scaling to Hounsfield units is known" in advice) == (voxels.dtype == np.uint8)
    assert ("plus 1024 are typical of a CT" in advice) == (voxels.dtype != np.uint8)
    flags = advice[advice.index("--preset ct") :].partition(";")[0].split()
    assert main(["plan", str(source), "-o", str(tmp_path / "out"), *flags]) == 0
    assert "is assumed" not in capsys.readouterr().err
    plan = OutFolder(tmp_path / "out").plan()
    assert plan.modality == "CT"
    assert level[0] <= float(plan.settings.iso_values["NIfTI"]) <= level[1]
    assert plan.settings.windows["NIfTI"] == (window or plan.settings.windows["NIfTI"])


@pytest.mark.parametrize(
    ("preset", "voxels", "words"),
    [
        (
            "ct",
            _body(24, 1064),
            "plus 1024, and its iso-value of -300 is meant for Hounsfield units",
        ),
        ("ct-bone", _body(24, 1064), "(or --preset ct-bone --iso-value 0=1324 --window 0=0:3024)"),
        ("ct", _body(20, 180).astype(np.uint8), "8-bit values, which are no Hounsfield units"),
        ("ct-bone", _body(20, 180).astype(np.uint8), "--iso-value 0=VALUE"),
        ("ct", _body(-1000, 40), ""),
    ],
)
def test_a_note_doubts_a_preset_of_ct_for_other_values_and_prints_the_flags_that_fit(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    preset: str,
    voxels: NDArray[np.int16],
    words: str,
) -> None:
    source = _nifti(tmp_path / "a.nii", voxels)
    assert main(["plan", str(source), "-o", str(tmp_path / "out"), "--preset", preset]) == 0
    output = capsys.readouterr().err.replace("\n", " ")
    assert words in output if words else "Hounsfield" not in output
    again = [str(source), "-o", str(tmp_path / "b"), "--preset", preset, "--iso-value", "0=80"]
    assert main(["plan", *again]) == 0
    assert "is meant for Hounsfield units" not in capsys.readouterr().err


@pytest.mark.parametrize("preset", ["ct", "ct-bone"])
@pytest.mark.parametrize(
    "voxels",
    [
        _body(24, 1064),
        _body(20, 180).astype(np.uint8),
        (_body(-1000, 40).astype(np.int32) + 32768).astype(np.uint16),
        (_body(24, 1064) / 2000).astype(np.float32),
    ],
    ids=["offset", "8 bits", "unsigned", "normalised"],
)
def test_levels_of_ct_presets_are_ignored_for_values_that_are_not_hounsfield_units(
    tmp_path: Path, preset: str, voxels: NDArray[np.generic]
) -> None:
    """For DICOM see tests/read/formats/dicom/test_value_scales.py."""
    out = tmp_path / "out"
    source = _nifti(tmp_path / "a.nii", voxels)
    assert main(["plan", str(source), "-o", str(out), "--preset", preset]) == 0
    plan = OutFolder(out).plan()
    assert (plan.settings.iso_values, plan.settings.windows) == ({}, {})
    assert not plan.is_hounsfield
    assert sum("its iso-value and window are ignored" in note for note in plan.notes) == 1
    own = ["--preset", preset, "--iso-value", "0=300", "--window", "0=0:900"]
    assert main(["plan", str(source), "-o", str(tmp_path / "own"), *own]) == 0
    settings = OutFolder(tmp_path / "own").plan().settings
    assert (settings.iso_values, settings.windows) == ({"NIfTI": 300}, {"NIfTI": "0:900"})


def test_a_part_of_a_body_without_air_keeps_the_level_for_bone(tmp_path: Path) -> None:
    source = _nifti(tmp_path / "a.nii", _body(40, 900))
    assert main(["plan", str(source), "-o", str(tmp_path / "out"), "--preset", "ct-bone"]) == 0
    plan = OutFolder(tmp_path / "out").plan()
    assert plan.settings.iso_values == {"NIfTI": 300}
    assert any("is meant for Hounsfield units (--iso-value 0=VALUE" in note for note in plan.notes)


def test_values_in_advised_flags_are_short_and_have_no_exponent(tmp_path: Path) -> None:
    for voxels in (
        (_body(-1000, 40).astype(np.int32) + 32768).astype(np.uint16),
        (_body(20, 180) / 700).astype(np.float32),
    ):
        _, (_, advice) = choose_preset(open_dataset(_nifti(tmp_path / "a.nii", voxels)))
        numbers = re.findall(r"(?<=[=:])-?[0-9.e+]+", advice)
        assert len(numbers) == 3
        for number in numbers:
            assert "e" not in number
            assert len(number.strip("-").replace(".", "").strip("0")) <= 3


def test_the_shifted_levels_are_those_of_the_presets() -> None:
    for preset, level in LEVELS_HU.items():
        settings = load(preset, None, flags={})
        assert settings.iso_values["*"] == level
        assert settings.windows["*"] == f"{WINDOW_HU[0]:g}:{WINDOW_HU[1]:g}"


def test_a_note_doubts_a_stated_ct_with_unsigned_values(tmp_path: Path) -> None:
    voxels = _body(24, 1064).astype("<u2")
    head = "ObjectType = Image\nNDims = 3\nDimSize = 32 30 24\nElementType = MET_USHORT\n"
    head += "Modality = MET_MOD_CT\nElementSpacing = 1 1 1\nElementDataFile = LOCAL\n"
    (tmp_path / "a.mha").write_bytes(head.encode() + voxels.tobytes())
    chosen, reason = choose_preset(open_dataset(tmp_path / "a.mha"))
    assert chosen == "ct"
    assert reason[0] == "preset ct: the input is CT (or --preset none for the defaults)"
    assert "plus 1024, and its iso-value of -300 is meant for Hounsfield units" in reason[1]
    assert "--preset ct --iso-value 0=724 --window 0=0:3024" in reason[1]


def test_a_ct_is_recognised_despite_padding_darker_than_air(tmp_path: Path) -> None:
    voxels = _body(-1000, 40)
    voxels[:, :8, :8] = voxels[:, -8:, -8:] = -3024  # outside of the scanner's round field of view
    assert choose_preset(open_dataset(_nifti(tmp_path / "a.nii", voxels)))[0] == "ct"


def test_a_few_negative_values_do_not_make_a_ct(tmp_path: Path) -> None:
    voxels = _body(3700, 12_000)
    voxels[:4, :4, :4] = -610  # resampling by splines gives an atlas such values
    chosen, reason = choose_preset(open_dataset(_nifti(tmp_path / "a.nii", voxels)))
    assert chosen == "mri"
    assert "no Hounsfield units" in reason[0]


def test_a_level_above_the_background_is_refused_for_ct(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = _nifti(tmp_path / "a.nii", _body(-1000, 40))
    assert main(["plan", str(source), "-o", str(tmp_path / "o"), "--iso-value", "0=200+b"]) == 2
    assert "above the background, which is never subtracted from CT" in capsys.readouterr().err


def test_the_input_s_modality_takes_precedence_over_the_settings(tmp_path: Path) -> None:
    dataset = open_dataset(_nifti(tmp_path / "a.nii", _body(20, 400)))
    assert choose_preset(dataset, modality="CT")[0] == "ct"
    assert choose_preset(dataset, modality="PT")[0] == "pet"
    assert choose_preset(dataset, modality="US")[0] is None


def test_a_volume_too_small_for_a_patient_has_no_preset(tmp_path: Path) -> None:
    """The presets would remove all of an embryo in a small scanner."""
    dataset = open_dataset(_nifti(tmp_path / "a.nii", _body(20, 400), 0.2))
    for modality in ("", "MR"):
        chosen, reason = choose_preset(dataset, modality=modality)
        assert chosen is None
        assert "6.4 mm across, too small for a patient" in reason[0]
    assert main(["plan", str(tmp_path / "a.nii"), "-o", str(tmp_path / "o")]) == 0


@pytest.mark.parametrize(
    ("name", "chosen"),
    [
        ("pet.nii.gz", "pet"),
        ("sub-01_ses-2_trc-18FFDG_pet.nii", "pet"),
        ("SUV_scan.nii", "pet"),
        ("spect 3.nii", "pet"),
        ("pet_ct.nii", "mri"),  # the name of a study with several images
        ("t1w_in_pet_space.nii", "mri"),
        ("petra.nii", "mri"),  # the name of an MR sequence
        ("carpet.nii", "mri"),
        ("scan.nii", "mri"),
    ],
)
def test_the_source_s_name_states_pet_if_the_file_states_no_modality(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, chosen: str
) -> None:
    source = _nifti(tmp_path / name, _body(20, 400))
    assert main(["plan", str(source), "-o", str(tmp_path / "out")]) == 0
    printed = capsys.readouterr().err.replace("\n", " ")
    assert f"plan: preset {chosen}: " in printed
    assert ("in the source's name: PET is assumed, as heat" in printed) == (chosen == "pet")
    plan = OutFolder(tmp_path / "out").plan()
    assert plan.modality == ("PT" if chosen == "pet" else "MR")
    assert not any("18FFDG" in note for note in plan.notes)  # names may identify a patient


def test_the_note_on_an_assumed_mr_names_the_preset_for_pet(tmp_path: Path) -> None:
    _, notes = choose_preset(open_dataset(_nifti(tmp_path / "a.nii", _body(20, 400))))
    assert "for a PET or SPECT --preset pet, which shows heat" in notes[-1]


def test_hounsfield_units_are_a_ct_whatever_the_source_s_name_is(tmp_path: Path) -> None:
    source = _nifti(tmp_path / "pet.nii", _body(-1000, 40))
    assert load_for(source, None, None, flags={})[0].plan.modality == "CT"


@pytest.mark.parametrize(("spacing_mm", "chosen"), [(0.25, None), (0.35, "mri")])
def test_voxels_finer_than_those_of_patients_are_not_assumed_to_be_mr(
    tmp_path: Path, spacing_mm: float, chosen: str | None
) -> None:
    """Micro-CT and scanners for small animals have such voxels and show the whole body."""
    voxels = np.repeat(np.repeat(_body(20, 180).astype(np.uint8), 4, 1), 4, 2)
    preset, notes = choose_preset(open_dataset(_nifti(tmp_path / "a.nii", voxels, spacing_mm)))
    assert preset == chosen
    assert "no modality is stated" in notes[0]
    assert "for a CT --preset ct --iso-value 0=" in notes[1]


def test_voxels_of_micrometres_have_no_preset(tmp_path: Path) -> None:
    source = tmp_path / "a.ome.tif"
    phantoms.write_ome_tiff(source, _body(20, 400).astype(np.uint16), spacing=(1.0, 0.5, 0.5))
    assert choose_preset(open_dataset(source))[0] is None


@pytest.mark.parametrize(("finest_um", "chosen"), [(0.9, None), (2.0, "lightsheet"), (25.0, None)])
def test_voxels_of_a_few_micrometres_are_built_by_the_preset_lightsheet(
    tmp_path: Path, finest_um: float, chosen: str | None
) -> None:
    """Finer voxels show the surfaces of single cells, and wider voxels only tissue."""
    source = tmp_path / "a.ome.tif"
    spacing = (2.5 * finest_um, finest_um, finest_um)
    phantoms.write_ome_tiff(source, _body(20, 400).astype(np.uint16), spacing=spacing)
    preset, reason = choose_preset(open_dataset(source))
    assert preset == chosen
    assert ("cells are looked for" in reason[0]) == (chosen is not None)


def test_the_plan_states_that_voxels_are_those_of_a_microscope(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "a.ome.tif"
    phantoms.write_ome_tiff(source, _body(20, 400).astype(np.uint16), spacing=(1.0, 0.5, 0.5))
    assert main(["plan", str(source), "-o", str(tmp_path / "out")]) == 0
    output = capsys.readouterr().err
    assert (
        output.count("plan: no preset: voxels of 0.5 um, as of a microscope: lengths follow") == 1
    )


def test_the_plan_states_the_preset_with_its_reason_and_flags_override_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = _nifti(tmp_path / "it's.nii.gz", _body(-1000, 40))
    flags = ["-o", str(tmp_path / "out"), "--iso-value", "0=-500"]
    assert main(["plan", str(source), *flags]) == 0
    assert "plan: preset ct: voxels of 1 mm and values like Hounsfield units" in (
        capsys.readouterr().err
    )
    plan = OutFolder(tmp_path / "out").plan()
    assert plan.modality == "CT"
    assert plan.settings.iso_values == {"NIfTI": -500}
    assert plan.settings.windows == {"NIfTI": "-1024:2000"}


@pytest.mark.parametrize("preset", ["none", "cycif"])
def test_a_preset_that_the_user_names_causes_no_note(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], preset: str
) -> None:
    source = _nifti(tmp_path / "a.nii", _body(-1000, 40))
    flags = ["-o", str(tmp_path / "out"), "--preset", preset, "--region", "0:8,0:8,0:8"]
    main(["plan", str(source), *flags])
    assert "plan: preset" not in capsys.readouterr().err


def test_a_source_that_cannot_be_read_is_reported_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "a.nii"
    source.write_bytes(b"no image")
    settings, choice = load_for(source, None, None, flags={})
    assert (settings.plan.modality, choice) == ("", ())
    assert main(["plan", str(source), "-o", str(tmp_path / "out")]) == 1
    assert capsys.readouterr().err.count("\n") == 1


def test_hounsfield_units_of_a_mouse_are_a_ct_without_a_preset(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scales = [dict.fromkeys("zyx", 50.0)]  # um
    source = phantoms.write_ome_zarr(tmp_path / "mouse.ome.zarr", [_body(-1000, 40)], scales=scales)
    assert main(["plan", str(source), "-o", str(tmp_path / "out")]) == 0
    note = "values like Hounsfield units: taken for CT (--modality GM: it is a microscope's)"
    assert f"plan: {note}" in capsys.readouterr().err
    plan = OutFolder(tmp_path / "out").plan()
    assert (plan.modality, plan.channels[0].color) == ("CT", SKIN)
    assert note in plan.notes
    flags = ["-o", str(tmp_path / "light"), "--modality", "GM"]
    assert main(["plan", str(source), *flags]) == 0
    assert "Hounsfield" not in capsys.readouterr().err
    assert OutFolder(tmp_path / "light").plan().modality == "GM"
