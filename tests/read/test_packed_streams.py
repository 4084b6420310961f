"""Every compressed stream is read to its checksum, and damage is refused in one line."""

import bz2
import gzip
import hashlib
import zlib
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import hdf5plugin
import nibabel
import numcodecs
import numpy as np
import pyarrow
import pytest
import zstandard
from pyarrow import parquet
from zarr.codecs import BloscCodec, Crc32cCodec, GzipCodec, ZstdCodec

from stereocell import read
from stereocell.model.errors import SourceError
from stereocell.read.packed_stream import unpack
from stereocell.read.tables import read_table
from support.packed_files import (
    NOISE,
    Stream,
    dicom,
    hdf5,
    java_lz4,
    metaimage,
    mrc,
    n5,
    n5_of,
    nifti,
    nifti_of_members,
    nrrd_file,
    planes,
    tiff,
    zarr_2,
    zarr_3,
)
from support.reading import refusing


def zstd_stream(raw: bytes) -> bytes:
    """Return a frame that does not state its size, like Java's streams."""
    packer = zstandard.ZstdCompressor(write_checksum=True).compressobj()
    return packer.compress(raw) + packer.flush()


def of_numcodecs(name: str, **configuration: Any) -> dict[str, Any]:
    """Return a codec of numcodecs for Zarr 3."""
    return {"name": f"numcodecs.{name}", "configuration": configuration}


NONE = 0  # the stream has no checksum: a flipped byte gives other voxels, or the decoder refuses it


class Row(NamedTuple):
    """A compressed format.

    write        writes a file, and returns its packed stream
    checksum_at  bytes from the checksum's beginning to the stream's end; NONE: no checksum
    """

    write: Callable[[Path], Stream]
    checksum_at: int


ROWS = {
    "NIfTI, gzip": Row(nifti, 8),
    "NIfTI of three times, gzip": Row(partial(nifti, times=3), 8),
    "NIfTI, gzip of several members": Row(nifti_of_members, 8),
    "NIfTI pair, gzip": Row(partial(nifti, name="a.img.gz"), 8),
    "MRC, gzip": Row(partial(mrc, pack=gzip.compress, suffix=".gz"), 8),
    "MRC, bzip2": Row(partial(mrc, pack=bz2.compress, suffix=".bz2"), 4),
    "NRRD, gzip": Row(partial(nrrd_file, encoding="gzip"), 8),
    "NRRD, bzip2": Row(partial(nrrd_file, encoding="bzip2"), 4),
    "NRRD beside its header, gzip": Row(partial(nrrd_file, encoding="gzip", name="a.nhdr"), 8),
    "MetaImage, zlib": Row(metaimage, 4),
    "MetaImage beside its header, zlib": Row(partial(metaimage, name="a.mhd"), 4),
    "TIFF, deflate": Row(partial(tiff, compression="zlib"), 4),
    "TIFF, deflate by its old number": Row(partial(tiff, compression=32946), 4),
    "TIFF, LZMA": Row(partial(tiff, compression="lzma"), 12),
    "TIFF, zstd as tifffile writes it": Row(partial(tiff, compression="zstd"), NONE),
    "TIFF, LZW": Row(partial(tiff, compression="lzw"), NONE),
    "TIFF, PackBits": Row(partial(tiff, compression="packbits"), NONE),
    "TIFF, JPEG 2000": Row(partial(tiff, compression="jpeg2000"), NONE),
    "planes of PNG": Row(partial(planes, suffix=".png"), 4),
    "planes of TIFF, deflate": Row(partial(planes, suffix=".tif"), 4),
    "Zarr 2, gzip": Row(partial(zarr_2, codec=numcodecs.GZip(5)), 8),
    "Zarr 2, zlib": Row(partial(zarr_2, codec=numcodecs.Zlib(5)), 4),
    "Zarr 2, bzip2": Row(partial(zarr_2, codec=numcodecs.BZ2(5)), 4),
    "Zarr 2, LZMA": Row(partial(zarr_2, codec=numcodecs.LZMA()), 12),
    "Zarr 2, zstd with a checksum": Row(partial(zarr_2, codec=numcodecs.Zstd(checksum=True)), 4),
    "Zarr 2, CRC-32": Row(partial(zarr_2, codec=None, filters=[numcodecs.CRC32()]), 4),
    "Zarr 2, Adler-32": Row(partial(zarr_2, codec=None, filters=[numcodecs.Adler32()]), 4),
    "Zarr 2, Jenkins' lookup3": Row(
        partial(zarr_2, codec=None, filters=[numcodecs.JenkinsLookup3()]), 4
    ),
    "Zarr 2, Fletcher-32": Row(
        partial(zarr_2, codec=numcodecs.Blosc(), filters=[numcodecs.Fletcher32()]), 4
    ),
    "Zarr 2, zstd": Row(partial(zarr_2, codec=numcodecs.Zstd()), NONE),
    "Zarr 2, LZ4": Row(partial(zarr_2, codec=numcodecs.LZ4()), NONE),
    "Zarr 2, Blosc": Row(partial(zarr_2, codec=numcodecs.Blosc()), NONE),
    "Zarr 3, gzip": Row(partial(zarr_3, codecs=[GzipCodec()]), 8),
    "Zarr 3, zstd with a checksum": Row(partial(zarr_3, codecs=[ZstdCodec(checksum=True)]), 4),
    "Zarr 3, CRC-32C": Row(partial(zarr_3, codecs=[BloscCodec(), Crc32cCodec()]), 4),
    "Zarr 3, a shard with CRC-32C": Row(
        partial(zarr_3, codecs=[BloscCodec(), Crc32cCodec()], is_shard=True), 4
    ),
    "Zarr 3, CRC-32 of numcodecs": Row(
        partial(zarr_3, codecs=[GzipCodec(), of_numcodecs("crc32")]), 4
    ),
    "Zarr 3, Adler-32 of numcodecs": Row(partial(zarr_3, codecs=[of_numcodecs("adler32")]), 4),
    "Zarr 3, Fletcher-32 of numcodecs": Row(
        partial(zarr_3, codecs=[of_numcodecs("fletcher32")]), 4
    ),
    "Zarr 3, zlib of numcodecs": Row(partial(zarr_3, codecs=[of_numcodecs("zlib", level=5)]), 4),
    "Zarr 3, bzip2 of numcodecs": Row(partial(zarr_3, codecs=[of_numcodecs("bz2", level=5)]), 4),
    "Zarr 3, LZMA of numcodecs": Row(partial(zarr_3, codecs=[of_numcodecs("lzma", preset=1)]), 12),
    "Zarr 3, LZ4 of numcodecs": Row(
        partial(zarr_3, codecs=[of_numcodecs("lz4", acceleration=1)]), NONE
    ),
    "Zarr 3, zstd": Row(partial(zarr_3, codecs=[ZstdCodec()]), NONE),
    "Zarr 3, Blosc": Row(partial(zarr_3, codecs=[BloscCodec()]), NONE),
    "Zarr 3, a shard": Row(partial(zarr_3, codecs=[BloscCodec()], is_shard=True), NONE),
    "N5, gzip": Row(partial(n5, packing={"type": "gzip"}), 8),
    "N5, zlib": Row(partial(n5, packing={"type": "gzip", "useZlib": True}), 4),
    "N5, bzip2": Row(partial(n5, packing={"type": "bzip2"}), 4),
    "N5, xz": Row(partial(n5, packing={"type": "xz"}), 12),
    "N5, zstd": Row(partial(n5, packing={"type": "zstd"}), NONE),
    "N5, Blosc": Row(
        partial(n5, packing={"type": "blosc", "cname": "lz4", "clevel": 5, "shuffle": 1}), NONE
    ),
    "N5, zstd of a Java stream, with a checksum": Row(
        partial(n5_of, compression={"type": "zstd"}, pack=zstd_stream), 4
    ),
    "HDF5, gzip": Row(partial(hdf5, compression="gzip"), 4),
    "HDF5, Fletcher-32": Row(partial(hdf5, fletcher32=True), 4),
    "HDF5, LZF": Row(partial(hdf5, compression="lzf"), NONE),
    "HDF5, zstd": Row(partial(hdf5, **hdf5plugin.Zstd()), NONE),
    "DICOM, RLE": Row(dicom, NONE),
}


def opened(source: Path) -> read.Dataset:
    return read.open(source, spacing_um=(1.0, 1.0, 1.0))


def digest(source: Path) -> str:
    dataset = opened(source)
    return hashlib.sha256(dataset.read(0, dataset.levels[0].box).voxels.tobytes()).hexdigest()


refusal = refusing(digest)


@pytest.mark.parametrize("name", ROWS)
def test_damage_in_a_packed_file_is_refused_in_one_line(tmp_path: Path, name: str) -> None:
    row = ROWS[name]
    stream = row.write(tmp_path)
    content = stream.file.read_bytes()
    intact = digest(stream.source)

    flipped = bytearray(content)
    flipped[(stream.start + stream.stop) // 2] ^= 0x10
    stream.file.write_bytes(flipped)
    if row.checksum_at == NONE:
        with suppress(SourceError):  # both outcomes are right, and any other error is a fault
            digest(stream.source)
    else:
        refusal(stream.source)
        flipped = bytearray(content)
        flipped[stream.stop - row.checksum_at] ^= 0x10
        stream.file.write_bytes(flipped)
        refusal(stream.source)

    stream.file.write_bytes(content[:-8])
    refusal(stream.source)
    stream.file.write_bytes(content)
    assert digest(stream.source) == intact


def test_damage_in_lz4_of_n5_is_refused(tmp_path: Path) -> None:
    stream = n5_of(tmp_path, {"type": "lz4", "blockSize": 65536}, java_lz4)
    content = stream.file.read_bytes()
    assert opened(stream.source).read(0, opened(stream.source).levels[0].box).voxels.tobytes() == (
        NOISE.tobytes()
    )
    checksum, packed, middle = 16 + 17, 16 + 21 + 40, len(content) // 2
    for place in (checksum, packed, middle, len(content) - 5):
        flipped = bytearray(content)
        flipped[place] ^= 0x10
        stream.file.write_bytes(flipped)
        refusal(stream.source)
    for size in (len(content) - 8, middle, 16 + 21, 16):
        stream.file.write_bytes(content[:size])
        refusal(stream.source)


@pytest.mark.parametrize("behind", [b"", bytes(700), b"tape"])
@pytest.mark.parametrize("members", [1, 3])
def test_gzip_of_several_members_and_bytes_behind_it_are_read(behind: bytes, members: int) -> None:
    plain = NOISE.tobytes()
    step = -(-len(plain) // members)
    packed = b"".join(gzip.compress(plain[i : i + step]) for i in range(0, len(plain), step))
    assert unpack(packed + behind, 1000, "gzip", skip=77) == plain[77:1077]
    assert unpack(packed + behind, len(plain), "gzip") == plain


@pytest.mark.parametrize("packing", ["gzip", "zlib"])
@pytest.mark.parametrize("size", [0, 1, 1 << 18])
def test_a_stream_cut_at_any_of_its_last_bytes_is_refused(packing: str, size: int) -> None:
    pack = {"gzip": gzip.compress, "zlib": zlib.compress}[packing]
    packed = pack(np.random.default_rng(1).integers(0, 4, size, np.uint8).tobytes())
    assert len(unpack(packed, size, packing)) == size
    for missing in range(1, min(10, len(packed))):
        with pytest.raises(OSError, match="cut short"):
            unpack(packed[:-missing], size, packing)


def test_bytes_behind_the_voxels_are_read_up_to_a_limit() -> None:
    packed = gzip.compress(bytes(5000))
    assert unpack(packed, 10, "gzip", most_behind=4990) == bytes(10)
    with pytest.raises(OSError, match="unpacks to over 4989 bytes more than the 10"):
        unpack(packed, 10, "gzip", most_behind=4989)


@pytest.mark.parametrize("kind", [nibabel.Nifti1Pair, nibabel.AnalyzeImage])
def test_damage_in_the_packed_header_of_a_pair_is_refused(tmp_path: Path, kind: Any) -> None:
    source = tmp_path / "a.img.gz"
    nibabel.save(kind(NOISE.astype(np.int16), np.eye(4)), source)
    digest(source)
    header = tmp_path / "a.hdr.gz"
    content = bytearray(header.read_bytes())
    content[-8] ^= 1
    header.write_bytes(content)
    refusal(source)


def test_damage_in_another_time_point_is_refused(tmp_path: Path) -> None:
    """The checksum covers the whole stream, so all time points may be damaged."""
    stream = nifti(tmp_path, times=3)
    content = bytearray(stream.file.read_bytes())
    content[stream.stop - 400] ^= 0x10
    stream.file.write_bytes(content)
    assert "damaged" in refusal(stream.source)


@pytest.mark.slow
def test_damage_in_a_page_of_parquet_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    columns: dict[str, Any] = {"label": range(1, 5001), "area": np.arange(5000) * 0.37}
    table = pyarrow.table(columns)
    parquet.write_table(
        table, path, write_page_checksum=True, compression="none", use_dictionary=False
    )
    assert len(read_table(str(path), "label", (), "cells").labels) == 5000
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0x10
    path.write_bytes(content)
    again = r"\.parquet: damaged \(the library says: .*\), expected a complete Parquet file: copy"
    with pytest.raises(SourceError, match=again):
        read_table(str(path), "label", (), "cells")
