"""Write packed files of every reader by other libraries, and return where their streams lie.

The voxels are noise of four values, so that a stream is long and one flipped byte rarely breaks the
decoder.
"""

import gzip
import json
import struct
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import mrcfile
import nibabel
import nrrd
import numcodecs
import numpy as np
import SimpleITK
import tensorstore
import tifffile
import zarr
from numpy.typing import NDArray
from PIL import Image
from pydicom.uid import RLELossless

from stereocell.kernels.xxhash import xxh32
from support.dicom_series import compress, grid, write_series

SHAPE = (6, 40, 48)  # z, y, x
NOISE: NDArray[np.uint16] = np.random.default_rng(0).choice([0, 7, 300, 4000], SHAPE).astype("u2")


class Stream(NamedTuple):
    """A packed stream of a source, in the bytes `start` to `stop` of `file`."""

    source: Path
    file: Path
    start: int
    stop: int


def _whole(source: Path, file: Path | None = None, start: int = 0) -> Stream:
    held = file or source
    return Stream(source, held, start, held.stat().st_size)


def nifti(folder: Path, name: str = "a.nii.gz", times: int = 1) -> Stream:
    """Write a NIfTI file of one or more time points, or a pair of them."""
    xyzt = np.stack([NOISE.T + t for t in range(times)], axis=-1).astype(np.int16)
    kind: Any = nibabel.Nifti1Pair if ".img" in name else nibabel.Nifti1Image
    image = kind(xyzt if times > 1 else xyzt[..., 0], np.eye(4))
    image.header.set_xyzt_units("mm")
    nibabel.save(image, folder / name)
    return _whole(folder / name)


def nifti_of_members(folder: Path, padding: int = 0) -> Stream:
    """Write .nii.gz as several members of gzip, as bgzip and pigz do; zero bytes may follow."""
    plain = gzip.decompress(nifti(folder).file.read_bytes())
    parts = [gzip.compress(plain[i : i + 5000]) for i in range(0, len(plain), 5000)]
    packed = b"".join(parts)
    (folder / "a.nii.gz").write_bytes(packed + bytes(padding))
    return Stream(folder / "a.nii.gz", folder / "a.nii.gz", 0, len(packed))


def mrc(folder: Path, pack: Callable[[bytes], bytes], suffix: str) -> Stream:
    with mrcfile.new(folder / "plain.mrc") as file:
        file.set_data(NOISE)
        file.set_volume()
        file.voxel_size = 5.0
    path = folder / f"a.mrc{suffix}"
    path.write_bytes(pack((folder / "plain.mrc").read_bytes()))
    return _whole(path)


def nrrd_file(folder: Path, encoding: str, name: str = "a.nrrd") -> Stream:
    about: dict[str, Any] = {"encoding": encoding, "space": "left-posterior-superior"}
    about["space directions"] = np.diag([1.0, 1.0, 2.0])
    path = folder / name
    nrrd.write(str(path), NOISE, about, detached_header=name.endswith(".nhdr"), index_order="C")
    if name.endswith(".nhdr"):
        (file,) = (one for one in folder.iterdir() if one != path)
        return _whole(path, file)
    return _whole(path, start=path.read_bytes().index(b"\n\n") + 2)


def metaimage(folder: Path, name: str = "a.mha") -> Stream:
    path = folder / name
    SimpleITK.WriteImage(SimpleITK.GetImageFromArray(NOISE), str(path), useCompression=True)
    if name.endswith(".mhd"):
        return _whole(path, path.with_suffix(".zraw"))
    mark = b"ElementDataFile = LOCAL\n"
    return _whole(path, start=path.read_bytes().index(mark) + len(mark))


def tiff(folder: Path, compression: Any, **arguments: Any) -> Stream:
    path = folder / "a.ome.tif"
    about = {"axes": "ZYX", "PhysicalSizeX": 1.0, "PhysicalSizeY": 1.0, "PhysicalSizeZ": 1.0}
    tifffile.imwrite(path, NOISE, compression=compression, metadata=about, **arguments)
    with tifffile.TiffFile(path) as file:
        page = file.pages[2]
        start = page.dataoffsets[0]
        return Stream(path, path, start, start + page.databytecounts[0])


def planes(folder: Path, suffix: str) -> Stream:
    """Write a folder of one image file per z; return the packed stream of the last file.

    The stream of a PNG is its chunk IDAT.
    """
    for z, plane in enumerate(NOISE):
        path = folder / f"z{z}{suffix}"
        if suffix == ".png":
            Image.fromarray(plane).save(path)
        else:
            tifffile.imwrite(path, plane, compression="zlib")
    content = path.read_bytes()
    if suffix == ".png":
        start = content.index(b"IDAT") + 4
        (size,) = struct.unpack(">I", content[start - 8 : start - 4])
        return Stream(folder, path, start, start + size)
    with tifffile.TiffFile(path) as file:
        page = file.pages.first
        start = page.dataoffsets[0]
        return Stream(folder, path, start, start + page.databytecounts[0])


def _image_zarr(folder: Path, version: int, **codecs: Any) -> Stream:
    path = folder / "a.ome.zarr"
    group = zarr.open_group(path, mode="w", zarr_format=version)
    with warnings.catch_warnings(action="ignore"):  # zarr warns of codecs that only numcodecs has
        array = group.create_array("0", shape=SHAPE, dtype="u2", chunks=(3, 40, 48), **codecs)
        array[:] = NOISE
    axes = [{"name": a, "type": "space", "unit": "micrometer"} for a in "zyx"]
    level = {"path": "0", "coordinateTransformations": [{"type": "scale", "scale": [1, 1, 1]}]}
    about = {"axes": axes, "datasets": [level], "version": "0.4" if version == 2 else "0.5"}
    group.attrs.update(
        {"multiscales": [about]}
        if version == 2
        else {"ome": {"version": "0.5", "multiscales": [about]}}
    )
    chunk = path / "0" / ("1.0.0" if version == 2 else "c/1/0/0")
    return _whole(path, chunk if chunk.exists() else path / "0/c/0/0/0")


def zarr_2(folder: Path, codec: Any, filters: Any = None) -> Stream:
    return _image_zarr(folder, 2, compressors=codec, filters=filters)


def zarr_3(folder: Path, codecs: list[Any], is_shard: bool = False) -> Stream:
    shards = {"shards": SHAPE} if is_shard else {}
    return _image_zarr(folder, 3, compressors=codecs, **shards)


def n5(folder: Path, packing: dict[str, Any]) -> Stream:
    path = folder / "a.n5"
    spec = {
        "driver": "n5",
        "kvstore": f"file://{path}/",
        "metadata": {
            "dataType": "uint16",
            "dimensions": SHAPE[::-1],
            "blockSize": (48, 40, 3),
            "compression": packing,
            "resolution": [1, 1, 1],
            "units": ["um"] * 3,
        },
    }
    tensorstore.open(spec, create=True).result().write(NOISE.T).result()
    return _whole(path, path / "0/0/1", start=16)


def n5_of(folder: Path, compression: dict[str, Any], pack: Callable[[bytes], bytes]) -> Stream:
    """Write N5 whose blocks, behind their headers, are packed by a function."""
    stream = n5(folder, {"type": "raw"})
    about = stream.source / "attributes.json"
    about.write_text(
        json.dumps(json.loads(about.read_text("utf-8")) | {"compression": compression})
    )
    for file in stream.source.glob("*/*/*"):
        content = file.read_bytes()
        file.write_bytes(content[:16] + pack(content[16:]))
    return _whole(stream.source, stream.file, start=16)


def java_lz4(raw: bytes) -> bytes:
    """Return a stream of Java's LZ4BlockOutputStream: a packed part, a raw part, and the end."""
    parts = b""
    for part, token in ((raw[:1000], 0x26), (raw[1000:], 0x16)):
        packed = part if token == 0x16 else numcodecs.lz4.compress(part)[4:]
        checksum = xxh32(part, 0x9747B28C) & 0x0FFFFFFF
        parts += struct.pack("<8sB3I", b"LZ4Block", token, len(packed), len(part), checksum)
        parts += packed
    return parts + struct.pack("<8sB3I", b"LZ4Block", 0x16, 0, 0, 0)


def hdf5(folder: Path, **filters: Any) -> Stream:
    path = folder / "a.h5"
    with h5py.File(path, "w") as file:
        data = file.create_dataset("raw", data=NOISE, chunks=(3, 40, 48), **filters)
        data.attrs["element_size_um"] = (1.0, 1.0, 1.0)
        file.flush()
        chunk = data.id.get_chunk_info(1)
    return Stream(path, path, chunk.byte_offset, chunk.byte_offset + chunk.size)


def dicom(folder: Path) -> Stream:
    """Write a series of one frame a file, packed by RLE; the stream is that of the last file."""
    paths = write_series(folder, grid(), (3, 30, 26))
    for path in paths:
        compress(path, RLELossless)
    content = paths[-1].read_bytes()
    return Stream(folder, paths[-1], content.rindex(b"\xfe\xff\x00\xe0") + 72, len(content) - 8)
