"""DICOM segmentations: one label map, or a mask of the requested segment."""

import json
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import highdicom
import numpy as np
import pydicom
import pytest
from numpy.typing import NDArray
from pydicom.sr.coding import Code

from stereocell import read
from stereocell.cli.__main__ import main
from stereocell.model.errors import SourceError, UsageError
from stereocell.read.label_map import LabelMap
from support.dicom_reading import lps_mm, whole
from support.dicom_segmentations import SPACING, write_segmentation
from support.dicom_series import grid, tilted, turn

SHAPE = (6, 9, 7)  # 63 bits a plane, so that planes don't begin at whole bytes
AFFINE = grid(shape=SHAPE, spacing=SPACING)


def masks() -> NDArray[np.uint8]:
    """Return two segments that overlap in every plane, (slices, rows, columns, segments)."""
    both = np.zeros((*SHAPE, 2), np.uint8)
    both[:, 1:5, 1:4, 0] = 1
    both[:, 3:8, 2:6, 1] = 1
    both[2, 0, 6] = 1
    return both


def apart() -> NDArray[np.uint8]:
    """Return the segments of `masks` without overlap: common voxels belong to the first."""
    voxels = masks()
    voxels[..., 1] &= 1 - voxels[..., 0]
    return voxels


def numbered(voxels: NDArray[Any]) -> NDArray[Any]:
    """Return the label map of segments that don't overlap, with labels from 1 on."""
    return voxels @ np.arange(1, voxels.shape[-1] + 1, dtype=np.uint8)


def labels_of(dataset: read.Dataset, channel: int = 0) -> NDArray[Any]:
    return LabelMap(dataset, channel).read(dataset.levels[0].box)


def on_our_grid(
    voxels: NDArray[Any], dataset: read.Dataset, affine: NDArray[np.float64] = AFFINE
) -> NDArray[Any]:
    """Return the stored voxels (slice, row, column) at the positions of the dataset's voxels."""
    step = np.linalg.inv(affine)
    index = np.rint(lps_mm(dataset) @ step[:3, :3].T + step[:3, 3]).astype(int)
    return voxels[index[..., 0], index[..., 1], index[..., 2]]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["BINARY", "FRACTIONAL", "LABELMAP"])
def test_a_segmentation_adds_a_line_without_its_texts_to_the_plan(
    tmp_path: Path, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    voxels = apart() if kind == "LABELMAP" else masks()
    path = write_segmentation(tmp_path, kind, voxels)
    assert main(["plan", str(path), "-o", str(tmp_path / "out")]) == 2
    printed = capsys.readouterr()
    assert "is a label map: found a DICOM segmentation of 2 segments" in printed.err
    assert "--as intensity" in printed.err
    assert main(["plan", str(path), "-o", str(tmp_path / "out"), "--series", "list"]) == 0
    assert not {"JANE", "DOE", "lung"} & set(capsys.readouterr().out.replace("^", " ").split())
    assert "JANE" not in printed.err


@pytest.mark.parametrize("kind", ["BINARY", "FRACTIONAL"])
@pytest.mark.slow
def test_each_segment_is_a_separate_mask(tmp_path: Path, kind: str) -> None:
    path = write_segmentation(tmp_path, kind, masks())
    lines = read.list_series(path)
    assert [line.split(", ")[1] for line in lines] == ["segment 1", "segment 2"]
    theirs = highdicom.seg.segread(path)
    for number in (1, 2):
        dataset = read.open(path, series=number)
        assert np.array_equal(whole(dataset) > 0, on_our_grid(masks()[..., number - 1], dataset))
        volume = theirs.get_volume(segment_numbers=[number], combine_segments=False)
        assert np.count_nonzero(volume.array) == np.count_nonzero(whole(dataset))


def test_the_image_is_built_if_its_segmentation_is_beside_it(tmp_path: Path) -> None:
    write_segmentation(tmp_path, "BINARY", masks())
    dataset = read.open(tmp_path)
    assert (dataset.modality, dataset.labels) == ("MR", "")
    assert "3 series or orientations" in dataset.notes[0]


def test_a_segmentation_without_a_position_is_named_as_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_segmentation(tmp_path, "BINARY", masks())
    ds = pydicom.dcmread(path)
    for group in ds.PerFrameFunctionalGroupsSequence:
        del group.PlanePositionSequence
    ds.save_as(path)
    assert main(["plan", str(path), "-o", str(tmp_path / "out")]) == 2
    printed = capsys.readouterr().err
    assert "holding a segmentation of 2 segments, without a place in the patient" in printed
    assert "expected the image that it was drawn on" in printed


@pytest.mark.parametrize("overlap", ["NO", "UNDEFINED", None])
def test_binary_segments_are_one_label_map(tmp_path: Path, overlap: str | None) -> None:
    def change(ds: Any) -> None:
        ds.SegmentsOverlap = overlap
        if overlap is None:
            del ds.SegmentsOverlap

    dataset = read.open(write_segmentation(tmp_path, "BINARY", apart(), change))
    assert len(dataset.channels) == 1
    assert np.array_equal(labels_of(dataset), on_our_grid(numbered(apart()), dataset))
    assert "a DICOM segmentation of 2 segments" in dataset.labels


@pytest.mark.parametrize("overlap", ["YES", "UNDEFINED"])
def test_overlapping_segments_are_separate_channels(tmp_path: Path, overlap: str) -> None:
    def change(ds: Any) -> None:
        ds.SegmentsOverlap = overlap

    dataset = read.open(write_segmentation(tmp_path, "BINARY", masks(), change))
    assert [channel.name for channel in dataset.channels] == ["segment 1", "segment 2"]
    for index in (0, 1):
        expected = on_our_grid(masks()[..., index] * (index + 1), dataset)
        assert np.array_equal(labels_of(dataset, index), expected)


def test_segments_that_overlap_against_the_header_are_noted(tmp_path: Path) -> None:
    def change(ds: Any) -> None:
        ds.SegmentsOverlap = "NO"

    dataset = read.open(write_segmentation(tmp_path, "BINARY", masks(), change))
    with pytest.raises(SourceError, match="segments that overlap, expected none"):
        labels_of(dataset)


@pytest.mark.parametrize("background", [0, 9])
def test_a_label_map_keeps_its_numbers(tmp_path: Path, background: int) -> None:
    def change(ds: Any) -> None:
        values = np.frombuffer(ds.PixelData, np.uint8)[: np.prod(SHAPE)]
        padded = np.where(values == 0, background, values).astype(np.uint8).tobytes()
        ds.PixelData = padded + bytes(len(padded) % 2)
        ds.PixelPaddingValue = background

    path = write_segmentation(tmp_path, "LABELMAP", apart(), change)
    for series in (0, 1):
        dataset = read.open(path, series=series)
        assert np.array_equal(labels_of(dataset), on_our_grid(numbered(apart()), dataset))


def test_a_label_map_with_a_palette_keeps_its_numbers(tmp_path: Path) -> None:
    def change(ds: Any) -> None:
        ds.PhotometricInterpretation = "PALETTE COLOR"

    dataset = read.open(write_segmentation(tmp_path, "LABELMAP", apart(), change))
    assert np.array_equal(labels_of(dataset), on_our_grid(numbered(apart()), dataset))


@pytest.mark.parametrize("kind", ["BINARY", "LABELMAP"])
@pytest.mark.parametrize("kept", [(0, 5), (0, 1, 4), (3,)])
@pytest.mark.parametrize("states_spacing", [True, False])
def test_omitted_planes_are_empty(
    tmp_path: Path, kind: str, kept: tuple[int, ...], states_spacing: bool
) -> None:
    def change(ds: Any) -> None:
        if not states_spacing:
            shared = ds.SharedFunctionalGroupsSequence[0]
            del shared.PixelMeasuresSequence[0].SpacingBetweenSlices

    voxels = apart()
    voxels[[plane for plane in range(SHAPE[0]) if plane not in kept]] = 0
    path = write_segmentation(tmp_path, kind, voxels, change, omit_empty=True)
    if kept == (3,) and not states_spacing:
        with pytest.raises(UsageError, match="with one plane and without SpacingBetweenSlices"):
            read.open(path)
        return
    if kept == (0, 5) and not states_spacing:  # nothing states that there were planes between them
        assert max(read.open(path).levels[0].spacing_um) == 5 * 1000 * SPACING[0]
        return
    dataset = read.open(path)
    found = labels_of(dataset)
    assert sorted(dataset.levels[0].spacing_um) == pytest.approx([2000, 2200, 2500])
    there = found > 0
    expected = on_our_grid(numbered(np.concatenate([voxels, voxels[:1] * 0])), dataset)
    assert np.array_equal(found[there], expected[there])
    assert np.count_nonzero(there) == np.count_nonzero(voxels)


def test_fractions_are_not_read_as_labels(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    half = masks() * 0.5
    path = write_segmentation(tmp_path, "FRACTIONAL", half)
    out = str(tmp_path / "out")
    images = str(tmp_path / "images")
    for flags in ([str(path), "--labels", "."], [images, "--labels", f"a={path}"]):
        assert main(["plan", *flags, "-o", out]) == 2
        printed = capsys.readouterr().err
        assert "with fractions (FRACTIONAL) instead of bits or numbers" in printed
        assert "--series N --as intensity" in printed
    with pytest.raises(SourceError, match=r"found 0\.50.*, expected whole numbers in labels"):
        labels_of(read.open(path, series=1))


def test_objects_are_named_with_the_standards_words_alone(tmp_path: Path) -> None:
    def change(ds: Any) -> None:
        left = pydicom.Dataset()
        left.CodeValue, left.CodingSchemeDesignator = "7771000", "SCT"
        left.CodeMeaning = "JANE"
        for item in ds.SegmentSequence:
            item.SegmentDescription = item.TrackingID = "JANE"
        first = ds.SegmentSequence[0].SegmentedPropertyTypeCodeSequence[0]
        first.SegmentedPropertyTypeModifierCodeSequence = [left]

    types = [
        Code("64033007", "SCT", "kidney of JANE"),
        Code("T-62000", "SRT", "liver of JANE"),
        Code("1234", "99DOE", "JANE"),
        Code("39607008", "SCT", "JANE"),
        Code("39607008", "SCT", "JANE"),
    ]
    voxels = np.zeros((*SHAPE, 5), np.uint8)
    for number in range(5):
        voxels[:, number, :, number] = 1
    path = write_segmentation(tmp_path, "BINARY", voxels, change, types=types)
    notes = read.open(path).objects
    assert notes.names == {
        1: "Kidney, left",
        2: "Liver",
        3: "Segment 3",
        4: "Lung (segment 4)",
        5: "Lung (segment 5)",
    }
    assert notes.colors.keys() == {1}
    assert notes.colors[1] == pytest.approx((1, 1, 1), abs=2e-3)


@pytest.mark.slow
def test_free_text_names_segments_if_requested(tmp_path: Path) -> None:
    def change(ds: Any) -> None:
        ds.SegmentSequence[0].SegmentLabel = "node  1\n\x1b[31m"
        ds.SegmentSequence[1].SegmentLabel = ""
        for item in ds.SegmentSequence:
            item.SegmentDescription = item.TrackingID = "secret"

    path = write_segmentation(tmp_path, "BINARY", apart(), change)
    out = tmp_path / "out"
    names = []
    for flags in ([], ["--segment-labels"]):
        assert main(["plan", str(path), "-o", str(out), "--labels", ".", *flags]) == 0
        for phase in ("units", "stage", "bundle"):
            assert main([phase, str(out), "--workers", "0"]) == 0
        objects = json.loads((out / "bundle/channels/labels/objects.json").read_text("utf-8"))
        assert "secret" not in json.dumps(objects)
        names.append(objects["names"])
    assert names == [["Lung (segment 1)", "Lung (segment 2)"], ["node 1 [31m", "Lung (segment 2)"]]
    assert main(["check", str(out), "--deep", "--workers", "0"]) == 0


def test_oblique_planes_keep_their_position(tmp_path: Path) -> None:
    affine = grid(shape=SHAPE, spacing=SPACING, rotation=turn((1, 2, -0.5), 23.0))
    path = write_segmentation(tmp_path, "BINARY", apart(), affine=affine)
    dataset = read.open(path)
    assert np.array_equal(labels_of(dataset), on_our_grid(numbered(apart()), dataset, affine))


def test_planes_of_a_tilted_gantry_are_refused(tmp_path: Path) -> None:
    affine = tilted(AFFINE, SHAPE, 18)
    path = write_segmentation(tmp_path, "BINARY", apart(), affine=affine)
    with pytest.raises(UsageError, match="with planes side by side, not on top of each other"):
        read.open(path)


def turned(ds: Any) -> None:
    group = pydicom.Dataset()
    group.ImageOrientationPatient = [0, 1, 0, 0, 0, 1]
    ds.PerFrameFunctionalGroupsSequence[0].PlaneOrientationSequence = [group]


def nameless(ds: Any) -> None:
    for group in ds.PerFrameFunctionalGroupsSequence:
        del group.SegmentIdentificationSequence


def moved(ds: Any, step: Sequence[float]) -> None:
    place = ds.PerFrameFunctionalGroupsSequence[2].PlanePositionSequence[0]
    place.ImagePositionPatient = [
        a + b for a, b in zip(place.ImagePositionPatient, step, strict=True)
    ]


@pytest.mark.parametrize(
    ("spoil", "expected"),
    [
        (turned, "with planes of 2 orientations or sizes"),
        (nameless, "with frames that name no segment"),
        (lambda ds: moved(ds, AFFINE[:3, 1]), "with planes side by side"),
        (lambda ds: moved(ds, 0.4 * AFFINE[:3, 0]), "with uneven gaps between planes"),
    ],
)
def test_planes_that_do_not_make_a_label_map_are_refused(
    tmp_path: Path, spoil: Callable[[Any], None], expected: str
) -> None:
    path = write_segmentation(tmp_path, "BINARY", apart(), spoil)
    with pytest.raises(UsageError, match=expected):
        read.open(path)


def test_two_segmentations_are_refused_unless_one_is_chosen(tmp_path: Path) -> None:
    first, second = (
        write_segmentation(tmp_path / name, "LABELMAP", apart()) for name in ("a", "b")
    )
    folder = tmp_path / "both"
    folder.mkdir()
    first.rename(folder / "a.dcm")
    second.rename(folder / "b.dcm")
    with pytest.raises(UsageError, match="found 2 segmentations, expected one"):
        read.open(folder)
    assert labels_of(read.open(folder, series=2)).max() == 2


def test_numbers_beyond_a_byte_are_kept(tmp_path: Path) -> None:
    def change(ds: Any) -> None:
        ds.SegmentSequence[1].SegmentNumber = 40_000
        for group in ds.PerFrameFunctionalGroupsSequence:
            segment = group.SegmentIdentificationSequence[0]
            if segment.ReferencedSegmentNumber == 2:
                segment.ReferencedSegmentNumber = 40_000

    dataset = read.open(write_segmentation(tmp_path, "BINARY", apart(), change))
    expected = on_our_grid(apart() @ np.array([1, 40_000]), dataset)
    assert np.array_equal(labels_of(dataset), expected)
    assert dataset.objects.names.keys() == {1, 40_000}


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["BINARY", "LABELMAP"])
def test_garbled_segmentations_raise_no_other_error(tmp_path: Path, kind: str) -> None:
    """Bytes are changed at random; a label map is still read, or refused in one line."""
    random = np.random.default_rng(0)
    path = write_segmentation(tmp_path, kind, apart())
    content = np.frombuffer(path.read_bytes(), np.uint8)
    for _ in range(60):
        garbled = content.copy()
        places = random.integers(132, len(content), random.integers(1, 12))
        garbled[places] = random.integers(0, 256, len(places))
        path.write_bytes(garbled.tobytes())
        with suppress(SourceError, UsageError):
            labels_of(read.open(path))
