"""Stored values of a DICOM file's frames, as pydicom hands them out."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pydicom
from numpy.typing import NDArray
from pydicom.encaps import generate_frames
from pydicom.pixels.utils import iter_pixels

from stereocell.read.dicom.codecs import PLUGINS, is_compressed
from stereocell.read.dicom.codestream import plane_size

_TAGS: list[Any] = [
    "Rows",
    "Columns",
    "SamplesPerPixel",
    "PhotometricInterpretation",
    "PlanarConfiguration",
    "NumberOfFrames",
    "BitsAllocated",
    "BitsStored",
    "HighBit",
    "PixelRepresentation",
    "ExtendedOffsetTable",
    "ExtendedOffsetTableLengths",
    "PixelData",
    "FloatPixelData",
    "DoubleFloatPixelData",
]


def open_pixels(path: Path) -> tuple[Any, str]:
    """Return a file's pixels and what they need to be decoded, and the decoder; empty: none.

    Raises DICOM_FAULTS.
    """
    dataset = pydicom.dcmread(path, force=True, specific_tags=_TAGS)
    syntax = dataset.file_meta.get("TransferSyntaxUID") if dataset.file_meta else None
    if syntax is None:  # without a file meta group: what the reader found the file to be
        implicit, little = dataset.original_encoding
        syntax = (
            pydicom.uid.ImplicitVRLittleEndian
            if implicit
            else pydicom.uid.ExplicitVRLittleEndian
            if little
            else pydicom.uid.ExplicitVRBigEndian
        )
        dataset.file_meta = pydicom.dataset.FileMetaDataset()
        dataset.file_meta.TransferSyntaxUID = syntax
    return dataset, PLUGINS[syntax] if is_compressed(syntax) else ""


def stored_values(dataset: Any, plugin: str, indices: Sequence[int]) -> Iterator[NDArray[Any]]:
    """Yield the values (rows, columns) of frames, in their containers. Raises DICOM_FAULTS."""
    if plugin:
        _check_streams(dataset)
    # all bits of the container: padding may lie in those above the stored ones
    return iter_pixels(
        dataset, indices=indices, raw=True, decoding_plugin=plugin, correct_unused_bits=False
    )


def _check_streams(dataset: Any) -> None:
    """Raise ValueError for a stream of another size than the header's: decoders believe streams."""
    count = int(dataset.get("NumberOfFrames") or 1)
    offsets = None
    if "ExtendedOffsetTable" in dataset:
        offsets = (dataset.ExtendedOffsetTable, dataset.ExtendedOffsetTableLengths)
    for stream in generate_frames(
        dataset.PixelData, number_of_frames=count, extended_offsets=offsets
    ):
        size = plane_size(stream)
        if size is not None and size != (dataset.Rows, dataset.Columns):
            raise ValueError
