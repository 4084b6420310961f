"""Tiles, angles and registrations of BigDataViewer, in HDF5 by h5py and in N5 by tensorstore."""

import shutil
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from stereocell import read
from stereocell.cli.__main__ import main
from stereocell.model.errors import SourceError, UsageError
from stereocell.planning import input_files
from stereocell.read import list_series
from support.array_files import write_n5
from support.phantoms import f_phantom
from support.reading import whole

BODY = f_phantom()
PLAIN = "0.2 0 0 0 0 0.2 0 0 0 0 0.5 0"


def write(
    folder: Path,
    setups: list[dict[str, Any]],
    *,
    size: str = "0.2 0.2 0.5",
    unit: str = "micrometer",
    kind: str = "hdf5",
) -> Path:
    """Write a container and its XML, and return the XML's path.

    setups  for each: `body` (z, y, x), and optionally `affines`, `name`, `size` and ATTRIBUTES
    """
    folder.mkdir(exist_ok=True)
    name = "a.h5" if kind == "hdf5" else "a.n5"
    views, placed = "", ""
    for number, setup in enumerate(setups):
        x, y, z = setup.get("stated", setup["body"].shape[::-1])
        attributes = "".join(f"<{key}>{setup[key]}</{key}>" for key in ATTRIBUTES if key in setup)
        views += (
            f"<ViewSetup><id>{number}</id><name>{setup.get('name', '')}</name><size>{x} {y} {z}"
            f"</size><voxelSize><unit>{unit}</unit><size>{setup.get('size', size)}</size>"
            "</voxelSize><attributes>"
            f"{attributes}</attributes></ViewSetup>"
        )
        affines = "".join(
            f'<ViewTransform type="affine"><affine>{text}</affine></ViewTransform>'
            for text in setup.get("affines", [])
        )
        placed += f'<ViewRegistration timepoint="0" setup="{number}">{affines}</ViewRegistration>'
        if kind == "n5":
            write_n5(folder / name / f"setup{number}" / "timepoint0" / "s0", setup["body"])
            (folder / name / f"setup{number}" / "attributes.json").write_text("{}")
    if kind == "hdf5":
        with h5py.File(folder / name, "w") as file:
            for number, setup in enumerate(setups):
                file[f"t00000/s{number:02d}/0/cells"] = setup["body"].astype(np.int16)
                file[f"s{number:02d}/resolutions"] = [[1.0, 1.0, 1.0]]
    path = folder / "a.xml"
    path.write_text(
        '<SpimData version="0.2"><SequenceDescription><ImageLoader format="bdv">'
        f'<file type="relative">{name}</file></ImageLoader><ViewSetups>{views}</ViewSetups>'
        '<Timepoints type="range"><first>0</first><last>0</last></Timepoints>'
        f"</SequenceDescription><ViewRegistrations>{placed}</ViewRegistrations></SpimData>"
    )
    return path


ATTRIBUTES = ("channel", "tile", "angle", "illumination", "phase", "displaysettings")


@pytest.mark.parametrize("kind", ["hdf5", "n5"])
@pytest.mark.parametrize("attribute", ["tile", "angle", "illumination"])
def test_each_view_is_a_separate_image(tmp_path: Path, kind: str, attribute: str) -> None:
    setups = [
        {"body": BODY + 100 * view + channel, "channel": channel, attribute: view}
        for view in (0, 1)
        for channel in (0, 1)
    ]
    path = write(tmp_path, setups, kind=kind)
    listed = list_series(path)
    assert len(listed) == 2
    assert f"{attribute} 1, 16 x 48 x 36 voxels, 2 channels" in listed[1]
    first, second = read.open(path), read.open(path, series=2)
    assert len(first.channels) == len(second.channels) == 2
    np.testing.assert_array_equal(whole(first, 1), BODY + 1)
    np.testing.assert_array_equal(whole(second, 1), BODY + 101)
    assert any("2 images; building --series 1" in note for note in first.notes)
    assert not any("images" in note for note in second.notes)
    with pytest.raises(UsageError, match="--series: found 3, expected 1 to 2"):
        read.open(path, series=3)


def test_a_container_named_by_itself_is_read_by_the_views_of_its_xml(tmp_path: Path) -> None:
    write(tmp_path, [{"body": BODY, "tile": 0}, {"body": BODY + 1, "tile": 1}])
    dataset = read.open(tmp_path / "a.h5")
    assert len(dataset.channels) == 1
    assert "to use --series, name the XML as the source" in dataset.notes[0]


def test_tiles_of_different_size_are_read_one_by_one(tmp_path: Path) -> None:
    path = write(tmp_path, [{"body": BODY[:8], "tile": 0}, {"body": BODY, "tile": 1}])
    np.testing.assert_array_equal(whole(read.open(path)), BODY)
    np.testing.assert_array_equal(whole(read.open(path, series=1)), BODY[:8])


@pytest.mark.parametrize("kind", ["hdf5", "n5"])
def test_a_spacing_that_only_the_registration_states_is_read(tmp_path: Path, kind: str) -> None:
    path = write(
        tmp_path, [{"body": BODY, "affines": ["1 0 0 0 0 1 0 0 0 0 2.4 0"]}], size="1 1 1",
        kind=kind,
    )  # fmt: skip
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == (2.4, 1.0, 1.0)
    assert "voxel spacing along z: the registration states 2.4 um" in dataset.notes[0]


@pytest.mark.parametrize(
    "affines",
    [
        [PLAIN],
        ["1 0 0 0 0 1 0 0 0 0 2.5 0"],  # a world that counts voxels, as in BigStitcher
        ["1 0 0 7 0 1 0 8 0 0 1 9", PLAIN],
        ["1 0 0 0 0 1 0 0 0 0 1 0"],  # the identity: not registered
        [],
    ],
)
def test_registrations_that_agree_with_the_voxel_size_need_no_note(
    tmp_path: Path, affines: list[str]
) -> None:
    dataset = read.open(write(tmp_path, [{"body": BODY, "affines": affines}]))
    assert dataset.levels[0].spacing_um == (0.5, 0.2, 0.2)
    np.testing.assert_array_equal(whole(dataset), BODY)
    assert dataset.notes == ()


def test_a_mirror_without_a_scale_keeps_the_voxel_size(tmp_path: Path) -> None:
    affine = "1 0 0 0 0 -1 0 47 0 0 1 0"
    dataset = read.open(write(tmp_path, [{"body": BODY, "affines": [affine]}]))
    assert dataset.levels[0].spacing_um == (0.5, 0.2, 0.2)
    np.testing.assert_array_equal(whole(dataset), BODY[:, ::-1])
    assert len(dataset.notes) == 1  # the note on the mirror


def test_the_registration_of_the_chosen_time_point_is_applied(tmp_path: Path) -> None:
    path = with_second_time(
        write(tmp_path, [{"body": BODY, "affines": [PLAIN]}]), "0.2 0 0 0 0 -0.2 0 9 0 0 1 0"
    )
    first, second = read.open(path), read.open(path, time=1)
    np.testing.assert_array_equal(whole(first), BODY)
    np.testing.assert_array_equal(whole(second), BODY[:, ::-1] + 50)
    assert (first.levels[0].spacing_um[0], second.levels[0].spacing_um[0]) == (0.5, 1.0)
    assert "voxel spacing along z: the registration states 1 um" in second.notes[0]


def with_second_time(path: Path, affine: str, missing: str = "") -> Path:
    """Add a time point with voxels that are brighter by 50 to an HDF5 container and its XML."""
    with h5py.File(path.with_suffix(".h5"), "a") as file:
        for name in file["t00000"]:
            file[f"t00001/{name}/0/cells"] = file[f"t00000/{name}/0/cells"][()] + 50
    placed = (
        '<ViewRegistration timepoint="1" setup="0"><ViewTransform type="affine">'
        f"<affine>{affine}</affine></ViewTransform></ViewRegistration></ViewRegistrations>"
    )
    text = path.read_text("utf-8").replace("</ViewRegistrations>", placed)
    text = text.replace("<last>0</last></Timepoints>", f"<last>1</last></Timepoints>{missing}")
    path.write_text(text, "utf-8")
    return path


def test_a_view_that_was_not_taken_is_left_out_at_its_time_point(tmp_path: Path) -> None:
    setups = [{"body": BODY + channel, "channel": channel} for channel in (0, 1)]
    missing = '<MissingViews><MissingView timepoint="1" setup="0"/></MissingViews>'
    path = with_second_time(write(tmp_path, setups), PLAIN, missing)
    with h5py.File(tmp_path / "a.h5", "a") as file:
        del file["t00001/s00"]
    assert len(read.open(path).channels) == 2
    dataset = read.open(path, time=1)
    assert len(dataset.channels) == 1
    np.testing.assert_array_equal(whole(dataset), BODY + 51)
    assert any("left out: setup 0" in note and "time point 1" in note for note in dataset.notes)


def test_a_view_that_was_never_taken_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, [{"body": BODY, "tile": 0}, {"body": BODY, "tile": 1}])
    missing = '<MissingViews><MissingView timepoint="0" setup="1"/></MissingViews>'
    text = path.read_text("utf-8")
    path.write_text(text.replace("</SequenceDescription>", f"{missing}</SequenceDescription>"))
    with h5py.File(tmp_path / "a.h5", "a") as file:
        del file["t00000/s01"]
    np.testing.assert_array_equal(whole(read.open(path)), BODY)
    with pytest.raises(SourceError, match="MissingViews of the XML lists all"):
        read.open(path, series=2)


def test_voxel_sizes_of_channels_that_differ_are_compared(tmp_path: Path) -> None:
    setups = [{"body": BODY, "channel": 0}, {"body": BODY, "channel": 1, "size": "0.2 0.2 1"}]
    dataset = read.open(write(tmp_path, setups))
    assert dataset.levels[0].spacing_um == (0.5, 0.2, 0.2)
    assert "voxelSize of setup 1 states 1 um: voxelSize of setup 0 is used" in dataset.notes[0]


def test_a_size_that_contradicts_the_container_is_noted(tmp_path: Path) -> None:
    dataset = read.open(write(tmp_path, [{"body": BODY, "stated": (36, 24, 16)}]))
    assert dataset.levels[0].shape == BODY.shape
    assert "the container states 36, 48, 16 voxels" in dataset.notes[0]


def test_an_own_attribute_separates_setups_of_one_channel(tmp_path: Path) -> None:
    setups = [{"body": BODY + phase, "channel": 0, "phase": phase} for phase in (0, 1)]
    path = write(tmp_path / "a", setups)
    assert "phase 1" in list_series(path)[1]
    np.testing.assert_array_equal(whole(read.open(path, series=2)), BODY + 1)
    dyes = [{"body": BODY, "channel": n, "phase": n, "displaysettings": n} for n in (0, 1)]
    assert len(read.open(write(tmp_path / "b", dyes)).channels) == 2


def test_setups_of_one_channel_are_not_overlaid(tmp_path: Path) -> None:
    setups = [{"body": BODY + 9 * number, "channel": 0, "tile": 0} for number in (0, 1)]
    path = write(tmp_path, setups)
    assert "setup 1, 16 x 48 x 36" in list_series(path)[1]
    np.testing.assert_array_equal(whole(read.open(path, series=2)), BODY + 9)


@pytest.mark.parametrize("kind", ["hdf5", "n5"])
def test_setups_without_an_xml_are_channels_with_a_note(tmp_path: Path, kind: str) -> None:
    write(tmp_path, [{"body": BODY, "tile": 0}, {"body": BODY, "tile": 1}], kind=kind).unlink()
    source = tmp_path / ("a.h5" if kind == "hdf5" else "a.n5")
    with pytest.raises(SourceError, match="states it in an XML, which is not beside"):
        read.open(source)
    dataset = read.open(source, spacing_um=(0.5, 0.2, 0.2))
    assert "whether they are tiles, angles or channels" in dataset.notes[0]


def test_transforms_compose_with_the_first_one_applied_last(tmp_path: Path) -> None:
    """Voxels are doubled along z, then z becomes x and x becomes reversed z."""
    affines = ["0 0 1 0 0 1 0 0 -1 0 0 40", "0.2 0 0 0 0 0.2 0 0 0 0 1 0"]
    dataset = read.open(write(tmp_path, [{"body": BODY, "affines": affines}]))
    assert dataset.levels[0].spacing_um == (0.2, 0.2, 1.0)
    np.testing.assert_array_equal(whole(dataset), BODY.transpose(2, 1, 0)[::-1])
    assert any("the registration is applied" in note for note in dataset.notes)
    assert dataset.slice_axis(0) == 2


def test_a_mirror_is_applied(tmp_path: Path) -> None:
    affine = "-0.2 0 0 7 0 0.2 0 0 0 0 0.5 0"
    dataset = read.open(write(tmp_path, [{"body": BODY, "affines": [affine]}]))
    np.testing.assert_array_equal(whole(dataset), BODY[:, :, ::-1])
    assert "stored axes z, y, -x" in dataset.notes[0]


def test_a_rotation_or_a_shear_is_not_applied_and_noted(tmp_path: Path) -> None:
    turn = "0.1732 -0.1 0 0 0.1 0.1732 0 0 0 0 0.5 0"
    dataset = read.open(write(tmp_path / "a", [{"body": BODY, "affines": [turn]}]))
    np.testing.assert_array_equal(whole(dataset), BODY)
    assert "turns the view by 30 degrees" in dataset.notes[0]
    shear = "0.2 0 0.25 0 0 0.2 0 0 0 0 0.433 0"
    sheared = read.open(write(tmp_path / "b", [{"body": BODY, "affines": [shear]}]))
    np.testing.assert_array_equal(whole(sheared), BODY)
    assert "shears the view by 30 degrees" in sheared.notes[0]
    mirrored = "-0.1732 -0.1 0 0 -0.1 0.1732 0 0 0 0 0.5 0"
    other = read.open(write(tmp_path / "c", [{"body": BODY, "affines": [mirrored]}]))
    np.testing.assert_array_equal(whole(other), BODY[:, :, ::-1])


def test_channels_that_are_registered_apart_are_noted(tmp_path: Path) -> None:
    setups = [
        {"body": BODY, "channel": 0, "affines": [PLAIN]},
        {"body": BODY, "channel": 1, "affines": ["0.2 0 0 0.6 0 0.2 0 0 0 0 0.5 0"]},
    ]
    dataset = read.open(write(tmp_path, setups))
    assert len(dataset.channels) == 2
    assert any("differ by up to 3 voxels" in note for note in dataset.notes)


@pytest.mark.parametrize(
    ("affine", "spacing"),
    [("0.4 0 0 0 0 0.4 0 0 0 0 0.5 0", (0.5, 0.4, 0.4)),
     ("-0.2 0 0 7 0 0.2 0 0 0 0 0.5 0", (0.5, 0.2, 0.2)),
     ("1 0 0 0 0 1 0 0 0 0 2.5 0", (2.5, 1.0, 1.0))],
)  # fmt: skip
@pytest.mark.parametrize("kind", ["hdf5", "n5"])
def test_channels_of_another_scale_or_direction_are_separate_images(
    tmp_path: Path, kind: str, affine: str, spacing: tuple[float, ...]
) -> None:
    setups = [
        {"body": BODY, "channel": 0, "affines": [PLAIN]},
        {"body": BODY + 1, "channel": 1, "affines": [affine]},
        {"body": BODY + 2, "channel": 2, "affines": ["0.2 0 0 0.6 0 0.2 0 0 0 0 0.5 0"]},
    ]
    path = write(tmp_path, setups, kind=kind)
    first, second = list_series(path)
    assert "setup 0, setup 2" in first
    assert "setup 1, registered apart from others" in second
    assert len(read.open(path).channels) == 2
    other = read.open(path, series=2)
    assert other.levels[0].spacing_um == pytest.approx(spacing)
    mirrored = BODY[:, :, ::-1] if affine.startswith("-") else BODY
    np.testing.assert_array_equal(whole(other), mirrored + 1)


@pytest.mark.parametrize("text", ["nan 0 0 0 0 inf 0 0 0 0 1 0", "1 0 0", "a b c"])
def test_a_registration_of_no_numbers_is_left_out_with_a_note(tmp_path: Path, text: str) -> None:
    setups = [
        {"body": BODY, "channel": 0, "affines": [text]},
        {"body": BODY, "channel": 1, "affines": [PLAIN]},
    ]
    dataset = read.open(write(tmp_path, setups))
    assert any(
        "registration don't span three dimensions: it is not applied" in note
        for note in dataset.notes
    )


def test_a_small_scale_or_angle_between_channels_is_named(tmp_path: Path) -> None:
    setups = [
        {"body": BODY, "channel": 0, "affines": [PLAIN]},
        {"body": BODY, "channel": 1, "affines": ["0.206 0 0 0 0 0.206 0 0 0 0 0.5 0"]},
        {"body": BODY, "channel": 2, "affines": ["0.197 -0.0347 0 0 0.0347 0.197 0 0 0 0 0.5 0"]},
    ]
    dataset = read.open(write(tmp_path, setups))
    assert len(dataset.channels) == 3
    (note,) = [note for note in dataset.notes if "registrations of the channels" in note]
    assert "with a scale of 0.03 and an angle of 10 degrees" in note


@pytest.mark.parametrize("kind", ["hdf5", "n5"])
def test_levels_that_one_channel_lacks_are_left_out(tmp_path: Path, kind: str) -> None:
    setups = [{"body": BODY, "channel": channel} for channel in (0, 1)]
    path = write(tmp_path, setups, kind=kind)
    half = BODY[::2, ::2, ::2]
    if kind == "hdf5":
        with h5py.File(tmp_path / "a.h5", "a") as file:
            file["t00000/s00/1/cells"] = half.astype(np.int16)
            del file["s00/resolutions"]
            file["s00/resolutions"] = [[1.0, 1.0, 1.0], [2.0, 2.0, 2.0]]
    else:
        write_n5(tmp_path / "a.n5" / "setup0" / "timepoint0" / "s1", half)
    dataset = read.open(path)
    assert (len(dataset.levels), len(dataset.channels)) == (1, 2)
    assert any("left out: 1 of 2 levels of detail" in note for note in dataset.notes)


@pytest.mark.parametrize(
    ("loader", "remedy"),
    [
        (
            '<zarr type="relative">a.ome.zarr</zarr>',
            "name an image in it, such as a.ome.zarr/IMAGE",
        ),
        ("<files/>", "name the image files themselves"),
    ],
)
def test_other_containers_are_refused_with_a_remedy(
    tmp_path: Path, loader: str, remedy: str
) -> None:
    path = write(tmp_path, [{"body": BODY}])
    (tmp_path / "a.ome.zarr").mkdir()
    (tmp_path / "a.ome.zarr" / ".zgroup").write_text('{"zarr_format": 2}')
    text = path.read_text("utf-8").replace('<file type="relative">a.h5</file>', loader)
    path.write_text(text, "utf-8")
    with pytest.raises(SourceError, match=remedy):
        read.open(path)


def test_a_registration_without_a_unit_is_a_hint(tmp_path: Path) -> None:
    path = write(tmp_path, [{"body": BODY, "affines": [PLAIN]}], size="1 1 1", unit="pixel")
    with pytest.raises(
        Exception, match=r"the registration has 0.5,0.2,0.2 \(z,y,x\) without a unit"
    ):
        read.open(path)


def test_the_xml_that_the_user_names_is_used_among_several(tmp_path: Path) -> None:
    path = write(tmp_path, [{"body": BODY, "affines": [PLAIN]}])
    other = tmp_path / "z.xml"
    other.write_text(path.read_text("utf-8").replace("0 0 0 0 0.5 0", "0 0 0 0 -0.5 0"))
    np.testing.assert_array_equal(whole(read.open(other)), BODY[::-1])
    np.testing.assert_array_equal(whole(read.open(path)), BODY)


@pytest.mark.slow
def test_lost_blocks_of_a_view_are_counted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    setups = [{"body": BODY + channel, "channel": channel} for channel in (0, 1)]
    path = write(tmp_path / "a", [one | {"affines": [PLAIN]} for one in setups], kind="n5")
    (tmp_path / "a" / "a.n5" / "setup1" / "timepoint0" / "s0" / "0" / "0" / "0").unlink()
    for source in (path, tmp_path / "a" / "a.n5"):
        input_files.forget()
        capsys.readouterr()
        assert main(["plan", str(source), "-o", str(tmp_path / "o"), "--as", "intensity"]) == 0
        assert "1 of 48 blocks of resolution level 0" in capsys.readouterr().err
        shutil.rmtree(tmp_path / "o")
