"""Malformed files of arrays and of makers: Imaris, HDF5, N5, NRRD, MetaImage, MRC, CZI, LIF."""

import json
import os
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from malformed.cases import Case, copied, edit_json, plan, put, slices

KIND = "arrays"
FILES = ("f.h5", "f.ims", "f.nrrd", "f.mha", "f.mrc", "f.czi", "f.lif")


def cases() -> Iterator[Case]:
    for name in FILES:
        yield _damaged(f"{name} is empty", lambda p: p.write_bytes(b""), name, "refused")
        yield _damaged(f"{name} is a folder", _to_folder, name, "refused")
        yield _damaged(f"{name} is a pipe", _to_pipe, name, "refused")
        yield _damaged(f"{name} is without end", _to_zeros, name, "refused")
    yield from _headers()
    yield from _hdf5()
    yield from _n5()


def _damaged(
    name: str,
    spoil: Callable[[Path], Any],
    file: str,
    expect: str = "any",
    command: Any = slices,
) -> Case:
    def make(base: Path, folder: Path) -> list[str]:
        path = copied(base, folder, file)
        spoil(path)
        words: list[str] = command(path.name, "--as", "intensity")
        return words

    return Case(name, KIND, make, expect)


def _to_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def _to_pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def _to_zeros(path: Path) -> None:
    path.unlink()
    path.symlink_to("/dev/zero")


def _replace(path: Path, old: str, new: str) -> None:
    content = path.read_bytes()
    assert old.encode() in content, old
    path.write_bytes(content.replace(old.encode(), new.encode("utf-8", "surrogateescape"), 1))


def _headers() -> Iterator[Case]:
    rows = {
        "f.nrrd": (
            ("sizes: 36 48 16", "sizes: 36 48 -16"),
            ("sizes: 36 48 16", "sizes: 99999 99999 99999"),
            ("sizes: 36 48 16", "sizes: 36 48"), ("sizes: 36 48 16", "sizes: 36 x 16"),
            ("dimension: 3", "dimension: 999"), ("dimension: 3", "dimension: \udcff"),
            ("encoding: raw", "encoding: gzip"),
            ("encoding: raw", "encoding: raw\ndata file: ../x"),
            ("encoding: raw", "encoding: raw\ndata file: LIST\na.raw\nb.raw"),
            ("encoding: raw", "encoding: raw\nline skip: 99999999999"),
            ("encoding: raw", "encoding: raw\nbyte skip: -7"), ("endian: little", "endian: middle"),
            ("endian: little", "endian: little\nendian: little"),
            ("endian: little", f"endian: little\nnote:={'x' * 100_000}"),
        ),
        "f.mha": (
            ("DimSize = 36 48 16", "DimSize = 36 48 -16"),
            ("DimSize = 36 48 16", "DimSize = 9e9 1 1"),
            ("DimSize = 36 48 16", "DimSize = nan 1 1"),
            ("DimSize = 36 48 16", "DimSize = 1.5 48 16"),
            ("DimSize = 36 48 16", f"DimSize = {'9' * 400} 48 16"),
            ("ElementSpacing", "ElementNumberOfChannels = 0\nElementSpacing"),
            ("ElementSpacing", "HeaderSize = 99999999999\nElementSpacing"),
            ("ElementSpacing", "HeaderSize = -1\nElementSpacing"),
            ("ElementSpacing", "Comment = \udcff\x00\nElementSpacing"),
            ("CompressedData = False", "CompressedData = True"),
            ("ElementDataFile = LOCAL", "ElementDataFile = ../../etc/passwd"),
            ("ElementDataFile = LOCAL", "ElementDataFile = f%03d.raw 1 9 1"),
            ("ElementDataFile = LOCAL", "ElementDataFile = "),
        ),
    }  # fmt: skip
    for file, changes in rows.items():
        for old, new in changes:
            name = f"{file} with {new[:50]!a}"
            yield _damaged(name, partial(_replace, old=old, new=new), file)


def _hdf5() -> Iterator[Case]:
    def changed(name: str, change: Callable[[h5py.File], Any], expect: str = "refused") -> Case:
        def spoil(path: Path) -> None:
            with h5py.File(path, "a") as file:
                change(file)

        return _damaged(f"HDF5: {name}", spoil, "f.h5", expect)

    def dataset(file: h5py.File, **options: Any) -> None:
        del file["raw"]
        file.create_dataset("raw", **options)

    yield changed("no dataset", lambda f: f.pop("raw"))
    yield changed("a second dataset", lambda f: f.copy("raw", "other"))
    yield changed("dataset of text", lambda f: dataset(f, data=["a", "b"]))
    yield changed("dataset of records", lambda f: dataset(f, shape=(4, 5, 6), dtype="u2,u2"))
    yield changed("dataset of complex", lambda f: dataset(f, shape=(4, 5, 6), dtype="c8"))
    yield changed("one number", lambda f: dataset(f, data=3))
    yield changed("without a shape", lambda f: dataset(f, dtype="u1", data=h5py.Empty("u1")))
    yield changed("2^60 voxels", lambda f: dataset(f, shape=(1 << 20,) * 3, dtype="u1"))
    yield changed(
        "chunks of 8 GB",
        lambda f: dataset(f, shape=(1 << 12,) * 3, dtype="u1", chunks=(1 << 10, 1 << 11, 1 << 10)),
        "any",
    )
    for value in (0.0, -1.0, float("nan"), float("inf"), "wide"):
        yield changed(
            f"element_size_um {value}",
            lambda f, v=value: f["raw"].attrs.update(element_size_um=[v] * 3),
        )
    for text in ("{", "[]", '{"axes": 3}', '{"axes": [{"key": "z"}]}', "x" * 10_000):
        yield changed(
            f"axistags {text[:20]}", lambda f, t=text: f["raw"].attrs.update(axistags=t), "any"
        )
    yield changed("a link in a circle", lambda f: f.update({"raw2": h5py.SoftLink("/raw2")}), "any")


def _n5() -> Iterator[Case]:
    for place, value in (
        (("dimensions",), [36, 48]), (("dimensions",), [1 << 30] * 3), (("dimensions",), None),
        (("blockSize",), [0, 0, 0]), (("blockSize",), [1 << 30] * 3), (("dataType",), "string"),
        (("compression",), {}), (("compression",), 3), (("compression", "type"), ["gzip"]),
        (("pixelResolution",), [1]), (("downsamplingFactors",), "x"), (("axes",), {"a": 1}),
        (("transform",), {"axes": 3, "scale": [1]}), (("units",), [1, 2]),
    ):  # fmt: skip

        def spoil(path: Path, place: Any = place, value: Any = value) -> None:
            edit_json(path / "attributes.json", put(*place, value))

        yield _damaged(f"N5: {'.'.join(place)} {json.dumps(value):.40}", spoil, "f.n5")
    yield _damaged(
        "N5: a block is a pipe", lambda p: _to_pipe(p / "0" / "0" / "0"), "f.n5", "refused"
    )
    yield _damaged(
        "N5: a block of another size",
        lambda p: (p / "0" / "0" / "0").write_bytes(np.array([0, 3, 0, 9], ">u2").tobytes()),
        "f.n5",
        "refused",
        plan,
    )
