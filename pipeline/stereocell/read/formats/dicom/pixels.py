"""Decode the pixels of DICOM frames: codec, bits, sign, MONOCHROME1, rescale, padding."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.read.formats.dicom.frame import Encoding, Frame
from stereocell.read.formats.dicom.gdcm_process import GdcmProcess
from stereocell.read.formats.dicom.padding import Padding, is_padding
from stereocell.read.formats.dicom.silence_logs import DICOM_FAULTS, quiet
from stereocell.read.formats.dicom.stored_values import open_pixels, stored_values
from stereocell.read.rescale import dtype_for, rescale
from stereocell.storage.library_errors import raise_if_short

_HALF = 16  # bits; values in containers of at most this size are unpacked to int32, others to int64


def dtype_of(frames: Sequence[Frame]) -> np.dtype[Any]:
    """Return a dtype that holds the grey values of all frames, from their headers alone."""
    encodings = {frame.encoding for frame in frames}
    if any(encoding.bits == 0 for encoding in encodings):
        return np.dtype(np.float32)
    return dtype_for(
        (*e.stored_range, e.slope, e.intercept) if e.table is None else (*e.grey_ends, 1.0, 0.0)
        for e in encodings
    )


def decode(
    frames: Sequence[Frame], paths: Sequence[Path], dtype: np.dtype[Any], shown: str
) -> NDArray[Any]:
    """Return the grey values of frames of one size, (n, rows, columns), `dtype`, in their order.

    paths  the files; `Frame.file` is the index
    shown  name of the source, for messages

    Each file is read once; the frames' padding is replaced (padding.py). Raises SourceError where a
    frame can't be decoded. The message names the file by its number among `paths`, never by its
    name.
    """
    padding = Padding()
    planes = np.empty((len(frames), frames[0].rows, frames[0].columns), dtype)
    has_padding = any(frame.encoding.padding is not None for frame in frames)
    order = sorted(range(len(frames)), key=lambda place: (frames[place].file, frames[place].index))
    with GdcmProcess() as apart:
        for file, places in groupby(order, key=lambda place: frames[place].file):
            wanted = list(places)
            where = f"{shown}: file {file + 1} of {len(paths)} in the order of names"
            of_index: dict[int, list[int]] = {}  # all slices of a mosaic are in one frame
            for place in wanted:
                of_index.setdefault(frames[place].index, []).append(place)
            indices = list(of_index)
            try:
                with quiet():
                    stored = _stored(paths[file], [frames[place] for place in wanted], apart)
                    for index, whole in zip(indices, stored, strict=True):
                        for place in of_index[index]:
                            frame, encoding = frames[place], frames[place].encoding
                            values = _plane_of(whole, frame)
                            raw = unpack_bits(values, encoding)
                            planes[place] = _grey_values(values, raw, encoding, dtype)
                            if has_padding:
                                mask = is_padding(values, raw, encoding)
                                padding.add(place, planes[place], mask)
            except DICOM_FAULTS as error:  # the error's text may quote values of the file
                raise_if_short(error, where)
                raise SourceError(
                    f"{where}: found pixels that can't be decoded, expected "
                    f"{frames[wanted[0]].rows} x {frames[wanted[0]].columns} undamaged ones, as in "
                    "the header"
                ) from None
    padding.fill(planes)
    return planes


def _stored(path: Path, frames: Sequence[Frame], apart: GdcmProcess) -> Iterable[NDArray[Any]]:
    """Return the stored values of a file's frames, each once, in their order.

    The header is read again only if frames must be decoded. Raises DICOM_FAULTS.
    """
    by_index = {frame.index: frame for frame in frames}
    if all(frame.start is not None for frame in frames):
        return [_plain_values(path, frame) for frame in by_index.values()]
    dataset, plugin = open_pixels(path)
    if plugin == "gdcm":
        return apart.decode(path, list(by_index))
    return stored_values(dataset, plugin, list(by_index))


def _plain_values(path: Path, frame: Frame) -> NDArray[Any]:
    encoding, count = frame.encoding, frame.rows * frame.columns
    kind = "f" if encoding.bits == 0 else "i" if encoding.is_signed else "u"
    dtype = f"<{kind}{encoding.allocated // 8}"
    values = np.fromfile(path, dtype, count, offset=frame.start or 0)
    if len(values) < count:  # the file is shorter than when its header was read
        raise ValueError
    return values.reshape(frame.rows, frame.columns)


def _plane_of(whole: NDArray[Any], frame: Frame) -> NDArray[Any]:
    """Return the pixels of a plane as a view; a mosaic's plane is one of its slices."""
    row, column = frame.corner
    return whole[row : row + frame.rows, column : column + frame.columns]


def _grey_values(
    values: NDArray[Any], raw: NDArray[Any], encoding: Encoding, dtype: np.dtype[Any]
) -> NDArray[Any]:
    """Return grey values, from the table or from slope and intercept.

    values  values in their containers
    raw     the same values, unpacked and inverted as `encoding` states
    """
    if encoding.table is None:
        return rescale(raw, encoding.slope, encoding.intercept, dtype)
    stored = unpack_bits(values, replace(encoding, is_inverted=False))
    return encoding.table.apply(stored, is_inverted=encoding.is_inverted).astype(dtype)


def unpack_bits(values: NDArray[Any], encoding: Encoding) -> NDArray[Any]:
    """Return stored values extracted from their containers: shifted, masked, sign-extended.

    values  integers or floats of any shape

    Bits above `high_bit` may hold an overlay and are cut off. Integers are returned in a signed
    dtype that holds them, or in their own.
    """
    if encoding.bits == 0:
        return values
    low, high = encoding.stored_range
    shift = encoding.high_bit + 1 - encoding.bits
    if encoding.bits < encoding.allocated or encoding.is_inverted or shift:
        wide: NDArray[np.signedinteger[Any]]
        wide = values.astype(np.int32 if encoding.allocated <= _HALF else np.int64)
        wide >>= shift
        wide &= (1 << encoding.bits) - 1
        if encoding.is_signed:
            wide -= (wide >> (encoding.bits - 1)) << encoding.bits
        return high + low - wide if encoding.is_inverted else wide
    return values
