"""`stereocell tissue OUT`: classes become channels, and nothing else is built again."""

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
import zarr
from numpy.typing import NDArray

from stereocell.building.out_folder import OutFolder
from stereocell.building.replaced_plan import replace_plan
from stereocell.cli.__main__ import main
from stereocell.planning.plan_file import from_json, to_json
from stereocell.samples.head import make_head
from stereocell.samples.head_dicom import PATIENT, write_dicom
from stereocell.steps import learn_tissue as learn_tissue_step
from stereocell.storage.assets import find_asset
from stereocell.storage.json_files import read_json
from stereocell.tissue.classify import TissueOptions
from stereocell.verify.formats import check
from support import phantoms
from support.bundles import channel, load
from support.onnx_models import write_model
from support.sealed_files import seal

pytestmark = pytest.mark.slow

SHAPE = (48, 40, 44)
HEAD = ["CSF", "grey matter", "white matter"]
QUICK = """
[lod]
errors = [1.0]
[unwrap]
max_texture = 64
"""


@pytest.fixture(scope="module", autouse=True)
def learned_once() -> Iterator[None]:
    """Learn each set of voxels only once: results are the same (tissue/test_classify.py)."""
    found: dict[tuple[bytes, str], Any] = {}
    learn = learn_tissue_step.learn_tissue

    def learn_once(voxels: NDArray[Any], spacing_um: Any, *, options: TissueOptions) -> Any:
        given = (np.ascontiguousarray(voxels).tobytes(), f"{voxels.dtype} {spacing_um} {options}")
        if given not in found:
            found[given] = learn(voxels, spacing_um, options=options)
        return found[given]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(learn_tissue_step, "learn_tissue", learn_once)
        yield


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A plan of the head from DICOM, without a build."""
    folder = tmp_path_factory.mktemp("tissue")
    write_dicom(folder / "head", make_head(shape=SHAPE, bias=0.3, seed=4), seed=4)
    out = folder / "out"
    given = ["--preset", "mri", "--level", "0"]
    assert main(["plan", str(folder / "head"), "-o", str(out), *given]) == 0
    return out


def add(out: Path, *flags: str) -> OutFolder:
    """Add the classes to the plan without building."""
    from stereocell.building.tissue import TissueRequest, add_tissue, parse_classes

    values = dict(zip(flags[::2], flags[1::2], strict=True))
    request = TissueRequest(
        parse_classes(values["--classes"]) if "--classes" in values else None,
        values.get("--channel", ""),
        Path(values["--model"]) if "--model" in values else None,
    )
    add_tissue(out, request)
    return OutFolder(out)


def test_each_class_is_a_channel_of_eight_bits_that_sum_to_one(planned: Path) -> None:
    plan = add(planned, "--classes", "3").plan()
    own, *added = plan.channels
    assert [channel.name for channel in added] == HEAD
    assert (own.name, own.source) == ("MR", "")
    assert len({channel.color for channel in plan.channels}) == 4
    assert [plan.settings.iso_values[name] for name in HEAD] == [127.5] * 3
    voxels = np.asarray(zarr.open_group(added[0].source, mode="r")["0"])
    assert voxels.dtype == np.uint8
    assert voxels.shape[1:] == plan.region.shape
    total = voxels.astype(int).sum(axis=0)
    brain = total > 0
    assert np.abs(total[brain] - 255).max() <= 2  # each class is rounded separately
    assert 0.1 < brain.mean() < 0.6


def test_the_record_fits_its_schema_and_names_no_patient(planned: Path) -> None:
    add(planned, "--classes", "3")
    record = read_json(planned / "tissue" / "tissue.json", "tissue.schema.json", "")
    assert [one["name"] for one in record["classes"]] == HEAD
    # the phantom has dark fluid, brighter grey matter and the brightest white matter
    csf, grey, white = (one["intensity"] for one in record["classes"])
    assert csf < grey < white
    for file in (planned / "tissue").rglob("*"):
        if file.is_file():
            content = file.read_bytes()
            assert PATIENT.encode() not in content
            assert str(planned).encode() not in content
    provenance = json.loads((planned / "provenance.json").read_text("utf-8"))
    assert set(provenance["added_channels"]) == set(HEAD)


def test_a_plan_with_classes_read_from_its_file_is_the_same_and_passes_its_schema(
    planned: Path,
) -> None:
    plan = add(planned, "--classes", "3").plan()
    content = json.loads(json.dumps(to_json(plan)))
    schema = json.loads(find_asset("schemas/plan.schema.json").read_text("utf-8"))
    jsonschema.validate(seal(content), schema)
    assert from_json(content) == plan


def test_a_copy_reads_its_own_classes_wherever_it_lies(planned: Path, tmp_path: Path) -> None:
    here = add(planned, "--classes", "3").plan()
    copy = OutFolder(shutil.copytree(planned, tmp_path / "moved"))
    there = copy.plan()
    for before, after in zip(here.channels[1:], there.channels[1:], strict=True):
        voxels = tmp_path.resolve() / "moved" / "tissue" / "classes.ome.zarr"
        assert (Path(after.source), after.fingerprint) == (voxels, before.fingerprint)
    assert str(planned.resolve()) not in copy.plan_file.read_text("utf-8")
    assert replace_plan(copy, there) is False


@pytest.mark.exhaustive
def test_classes_replace_earlier_ones(planned: Path, tmp_path: Path) -> None:
    add(planned, "--classes", "3")
    assert [c.name for c in add(planned, "--classes", "2").plan().channels] == [
        "MR", "tissue 1", "tissue 2",
    ]  # fmt: skip
    model = write_model(tmp_path / "m.onnx", slopes=(-1.0, 0.0, 1.0), names=["", "dim", "bright"])
    plan = add(planned, "--model", str(model)).plan()
    assert [channel.name for channel in plan.channels] == ["MR", "dim", "bright"]
    assert set(plan.settings.iso_values) == {"dim", "bright"}
    voxels = np.asarray(zarr.open_group(plan.channels[1].source, mode="r")["0"])
    assert voxels.shape[0] == 2


def test_the_same_command_again_learns_nothing(
    planned: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    add(planned, "--classes", "3")
    capsys.readouterr()
    add(planned, "--classes", "3")
    assert "up to date" in capsys.readouterr().err


def test_classes_do_not_depend_on_earlier_plans(tmp_path: Path) -> None:
    body = phantoms.f_phantom(1)
    source = phantoms.write_ome_tiff(
        tmp_path / "f.ome.tif", np.stack([body, body[:, ::-1]]), "CZYX", names=["first", "second"]
    )
    found = {}
    for name, earlier in (("detour", ["--channels", "0"]), ("straight", None)):
        out = tmp_path / name
        for flags in filter(lambda one: one is not None, (earlier, [])):
            assert main(["plan", str(source), "-o", str(out), *flags]) == 0
            plan = add(out, "--classes", "2").plan()
        assert len({channel.color for channel in plan.channels}) == 4
        files = sorted(file for file in (out / "tissue").rglob("*") if file.is_file())
        found[name] = {file.relative_to(out).as_posix(): file.read_bytes() for file in files}
        colors = [channel.color for channel in plan.channels]
        found[name]["colors"] = json.dumps(colors).encode()
    assert found["detour"] == found["straight"]


def test_wrong_use_is_refused_in_one_line(
    planned: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for flags, message in (
        (["--classes", "many"], "--classes is 'many', expected 2 to 6, or auto"),
        (["--channel", "CD8"], "--channel is 'CD8', expected one of MR"),
        (["--model", "none.onnx"], "none.onnx: No such file"),
    ):
        code = main(["tissue", str(planned), *flags])
        error = capsys.readouterr().err
        assert code in (1, 2)
        assert message in error
        assert error.count("\n") == 1


def test_a_build_gains_the_classes_and_keeps_its_other_results(
    planned: Path, tmp_path: Path
) -> None:
    (tmp_path / "quick.toml").write_text(QUICK)
    out, source = tmp_path / "out", planned.parent / "head"
    given = ["--preset", "mri", "--config", str(tmp_path / "quick.toml"), "--workers", "0"]
    assert main(["plan", str(source), "-o", str(out), *given[:-2]]) == 0
    for phase in ("units", "stage", "bundle"):  # the command below draws the report
        assert main([phase, str(out), "--workers", "0"]) == 0

    def built() -> dict[str, int]:
        files = (out / "units" / "r0_c0" / "MR").rglob("*")
        return {str(file): file.stat().st_mtime_ns for file in files if file.is_file()}

    before = built()
    assert main(["tissue", str(out), "--classes", "3", "--workers", "0"]) == 0
    assert built() == before
    assert len(list((out / "units").glob("window-MR-*.json"))) == 1
    assert [f"{line.name}: {line.detail}" for line in check(out) if not line.ok] == []

    names = [one["name"] for one in load(out / "bundle" / "manifest.json")["channels"]]
    assert names == ["MR", *HEAD]
    for name in HEAD:
        found = channel(out / "bundle", name)
        assert found["window"] == [0, 255]
        assert found["iso_value"] == pytest.approx(127.5)
        assert found["iso_normalized"] == pytest.approx(0.5)
    page = (out / "report" / "index.html").read_text("utf-8")
    assert "Tissue classes" in page
    assert all(name in page for name in HEAD)
