# ruff: noqa: E501  (tables of cases)
"""Objects: tables, label maps and DICOM segmentations that are cut short, false, or hostile."""

import contextlib
import io
import os
import shutil
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pydicom
import tifffile
import zarr

from malformed.base import cells_phantom
from malformed.cases import ODD_NAMES, Case, copied, cut, flip

_LABELS = "cells.tif"
_ROWS = "1,2.5\n2,3.5\n"


def cases() -> Iterator[Case]:
    yield from _texts()
    yield from _stores()
    yield from _labels()
    yield from _segmentations()


def _table(
    name: str, make_table: Callable[[Path], Any], file: str = "t.csv", expect: str = "refused", flags: tuple[str, ...] = ()
) -> Case:  # fmt: skip
    """A table that is joined to the intact label map."""

    def make(base: Path, folder: Path) -> list[str]:
        for one in ("f.ome.tif", _LABELS):
            copied(base, folder, one)
        if (base / file).exists():
            copied(base, folder, file)
        make_table(folder / file)
        return ["plan", "f.ome.tif", "-o", "out", "--labels", f"cells={_LABELS}", "--table", file, *flags]  # fmt: skip

    return Case(f"{file}: {name}", "tables", make, expect)


def _texts() -> Iterator[Case]:
    for name, text in {
        "empty": "", "blank": "\n\n\n", "header alone": "label,a\n", "no key": "a,b\n1,2\n", "key twice": "label,label\n1,2\n", "names alike": "label,a,a\n1,2,3\n",
        "a row short": "label,a\n1\n", "a row long": "label,a\n1,2,3\n", "object twice": "label,a\n1,2\n1,3\n", "object 0": "label,a\n0,1\n",
        "object -1": "label,a\n-1,1\n", "object NaN": "label,a\nnan,1\n", "object inf": "label,a\ninf,1\n", "object 1e400": "label,a\n1e400,1\n", "object 2^64": f"label,a\n{2**64},1\n",
        "object of 10^5 digits": "label,a\n" + "9" * 100_000 + ",1\n", "object in words": "label,a\none,1\n", "half an object": "label,a\n1.5,1\n",
        "open quote": 'label,a\n1,"2\n' + "3,4\n" * 50_000, "nul": "label,a\n1,\0\n",
    }.items():  # fmt: skip
        expect = "any" if name in ("nul", "header alone") else "refused"
        yield _table(name, lambda p, t=text: p.write_text(t), expect=expect)
    for name, text in {
        "object 2^63-1": f"label,a\n{2**63 - 1},1\n" + _ROWS, "numbers NaN": "label,a\n1,nan\n2,NaN\n", "numbers inf": "label,a\n1,inf\n2,-1e999\n",
        "numbers 1e300": "label,a\n1,1e300\n2,-1e300\n", "other objects": "label,a\n77,1\n", "nothing but gaps": "label,a,b\n1,,\n2,,\n", "a name of the product's": "label,volume_um3,displayColor\n1,1,2\n",
        "without a last line's end": "label,a\n1,2",
    }.items():  # fmt: skip
        yield _table(name, lambda p, t=text: p.write_text(t), expect="done")
    for name, text in ODD_NAMES.items():
        if name == "surrogate":
            continue
        quoted = '"' + text.replace('"', '""') + '"'
        yield _table(
            f"column named {name}",
            lambda p, q=quoted: p.write_text(f"label,{q}\n{_ROWS}", newline=""),
            expect="any",
        )
        yield _table(
            f"category named {name}",
            lambda p, q=quoted: p.write_text(f"label,a\n1,{q}\n2,x\n", newline=""),
            expect="any",
        )
        yield _table(
            f"no key but {name}", lambda p, q=quoted: p.write_text(f"{q},b\n{_ROWS}", newline="")
        )
    yield _table(
        "10^6 columns", lambda p: p.write_text("label," + ",".join(map(str, range(10**6))) + "\n")
    )
    yield _table("10^5 rows of garbage", lambda p: p.write_text("label,a\n" + "x,y\n" * 100_000))
    yield _table(
        "10^5 categories",
        lambda p: p.write_text("label,a\n" + "".join(f"{i},c{i}\n" for i in range(1, 100_000))),
        expect="done",
    )
    yield _table("a cell of 1 GB", partial(_fill, head=b"label,a\n1,"))
    yield _table("a quoted cell of 1 GB", partial(_fill, head=b'label,a\n1,"'))
    yield _table("a header of 1 GB", partial(_fill, head=b"label,"))
    yield _table(
        "a hole of 3 GB", lambda p: (p.write_bytes(b"label,a\n1,"), os.truncate(p, (1 << 30) - 1))
    )
    for name, content in {"latin 1": b"label,a\n1,\xe9\n", "noise": bytes(range(256)) * 9, "UTF-16": "label,a\n1,2\n".encode("utf-16"), "zip": b"PK\x03\x04" + bytes(99)}.items():  # fmt: skip
        expect = "done" if name in ("latin 1", "UTF-16") else "refused"
        yield _table(f"of {name}", lambda p, c=content: p.write_bytes(c), expect=expect)
    yield _table("is lost", lambda p: None)
    yield _table("is a folder", lambda p: p.mkdir())
    yield _table("is a pipe", lambda p: os.mkfifo(p))
    yield _table("is a link to itself", lambda p: p.symlink_to(p.name))
    yield _table("without end", lambda p: p.symlink_to("/dev/zero"))
    yield _table(
        "a column that isn't there",
        lambda p: p.write_text(f"label,a\n{_ROWS}"),
        flags=("--columns", "a,\x1b[31m"),
    )
    yield _table(
        "a key that isn't there",
        lambda p: p.write_text(f"label,a\n{_ROWS}"),
        flags=("--table-key", "../x"),
    )


def _fill(path: Path, head: bytes) -> None:
    """Write a start, and then the letter x up to nearly 1 GB."""
    with open(path, "wb") as file:
        file.write(head)
        for _ in range(1023):
            file.write(b"x" * (1 << 20))


def _stores() -> Iterator[Case]:
    for file in ("t.parquet", "t.h5ad"):
        yield _table("empty", lambda p: p.write_bytes(b""), file)
        yield _table("of text", lambda p: p.write_text(f"label,a\n{_ROWS}"), file)
        yield _table("is a folder", lambda p: (p.unlink(), p.mkdir()), file)
        yield _table("is a pipe", lambda p: (p.unlink(), os.mkfifo(p)), file)
        yield _table("without end", lambda p: (p.unlink(), p.symlink_to("/dev/zero")), file)
    one = pa.array([1, 2])
    for name, table in {
        "names alike": pa.table([one, one, one], names=["label", "a", "a"]), "no key": pa.table({"a": one}), "object missing": pa.table({"label": pa.array([1, None])}),
        "object twice": pa.table({"label": pa.array([1, 1])}), "object NaN": pa.table({"label": [1.0, float("nan")]}), "10^5 columns and one": pa.table([one] * 100_001, names=["label", *map(str, range(100_000))]),
        "object 0": pa.table({"label": [0, 1]}), "lists alone": pa.table({"label": pa.array([[1], [2]])}),
    }.items():  # fmt: skip
        yield _table(name, lambda p, t=table: pq.write_table(t, p), "t.parquet")
    for name, text in ODD_NAMES.items():
        if name != "surrogate":
            yield _table(
                f"column named {name}",
                lambda p, t=text: pq.write_table(
                    pa.table([one, one, pa.array([t, "x"])], names=["label", t, f"{t} 2"]), p
                ),
                "t.parquet",
                "any",
            )
    yield _table(
        "17 million rows of 0",
        lambda p: pq.write_table(pa.table({"label": np.ones(17_000_000, np.uint8)}), p),
        "t.parquet",
    )
    yield _table("texts of 280 MB", _large_parquet, "t.parquet", "any")
    for name, change in {
        "without obs": lambda f: f.__delitem__("obs"), "obs a list": lambda f: (f.__delitem__("obs"), f.__setitem__("obs", [1])),
        "without the order": lambda f: f["obs"].attrs.__delitem__("column-order"), "names a column that isn't there": lambda f: f["obs"].attrs.__setitem__("column-order", ["label", "x"]),
        "key in words": lambda f: (f["obs"].__delitem__("label"), f["obs"].__setitem__("label", ["a", "b"])), "key of 10^12": lambda f: _claim(f["obs"], "label", (10**12,)),
        "a column of 10^12": lambda f: _claim(f["obs"], "a", (10**12,)), "key of 2 axes": lambda f: _claim(f["obs"], "label", (2, 10**6)), "a column of another length": lambda f: _claim(f["obs"], "a", (3,)),
        "X of 10^12": lambda f: _claim(f, "X", (10**12, 2)), "X of other genes": lambda f: _claim(f, "X", (2, 3)), "X of one chunk of 3 GB": lambda f: (f.__delitem__("X"), f.create_dataset("X", (2, 2), maxshape=(None, None), chunks=(1 << 14, 1 << 14), dtype="f8", compression="gzip")),
        "X sparse of nothing": lambda f: (f.__delitem__("X"), f.create_group("X").attrs.update({"encoding-type": "csr_matrix", "shape": [2, 2]})),
        "X of an unknown kind": lambda f: (f.__delitem__("X"), f.create_group("X").attrs.update({"encoding-type": "\x1b[31m", "shape": [2, 2]})),
        "obs elsewhere": lambda f: (f.__delitem__("obs"), f.__setitem__("obs", h5py.ExternalLink("../bait/secret.txt", "/obs"))),
        "links in a circle": lambda f: (f.__delitem__("obs"), f.__setitem__("obs", h5py.SoftLink("/obs"))),
        "key in another file": lambda f: (f["obs"].__delitem__("label"), f["obs"].create_dataset("label", (2,), "i8", external=[("/etc/hostname", 0, 16)])),
        "records": lambda f: (f["obs"].__delitem__("label"), f["obs"].create_dataset("label", (2,), np.dtype([("x", "i4")]))),
        "texts of 10^9": lambda f: (f["obs"].__delitem__("label"), f["obs"].create_dataset("label", (2,), h5py.string_dtype(length=10**9), chunks=None)),
    }.items():  # fmt: skip
        yield _table(name, partial(_change_h5ad, change=change), "t.h5ad")
    for name, change in {
        "without obs": lambda g: g.__delitem__("obs"), "key of 10^12": lambda g: _claim_zarr(g["obs"], "label", (10**12,)), "a column of 10^12": lambda g: _claim_zarr(g["obs"], "a", (10**12,)),
        "X of 10^12": lambda g: _claim_zarr(g, "X", (10**12, 2)),
    }.items():  # fmt: skip
        yield _table(name, lambda p, c=change: c(zarr.open_group(p, mode="a")), "t.zarr")
    for share in (0.0, 0.5):
        yield _table(
            f"metadata cut to {share:g}", lambda p, s=share: cut(p / "obs/zarr.json", s), "t.zarr"
        )
        yield _table(
            f"a chunk cut to {share:g}", lambda p, s=share: cut(p / "obs/label/c/0", s), "t.zarr"
        )
    yield _table("is empty", lambda p: (shutil.rmtree(p), p.mkdir()), "t.zarr")
    yield _table("unknown kind", lambda p: p.write_bytes(b"PK\x03\x04"), "t.xlsx")


def _large_parquet(path: Path) -> None:
    """Write 40 texts of 7 MB, which take very little space in the file."""
    schema = pa.schema({"label": pa.int64(), "a": pa.string()})
    with pq.ParquetWriter(path, schema, use_dictionary=False, compression="zstd") as writer:
        for number in range(40):
            row = [pa.array([number + 1]), pa.array(["x" * 7_000_000])]
            writer.write_batch(pa.record_batch(row, schema=schema))


def _change_h5ad(path: Path, change: Callable[[Any], Any]) -> None:
    with h5py.File(path, "a") as file:
        change(file)


def _claim(group: Any, name: str, shape: tuple[int, ...]) -> None:
    """Replace a dataset by one that states a shape and stores nothing."""
    del group[name]
    group.create_dataset(name, shape, "f8", chunks=tuple(min(n, 1000) for n in shape))


def _claim_zarr(group: Any, name: str, shape: tuple[int, ...]) -> None:
    del group[name]
    group.create_array(name, shape=shape, chunks=tuple(min(n, 1000) for n in shape), dtype="f8")


def _label_map(
    name: str, write: Callable[[Path], Any], file: str = "l.tif", expect: str = "refused"
) -> Case:
    """A label map beside the intact image, which is planned and passed to `units`."""

    def make(base: Path, folder: Path) -> list[str]:
        copied(base, folder, "f.ome.tif")
        write(folder / file)
        words = ["f.ome.tif", "-o", "out", "--labels", f"cells={file}"]
        return _planned(words) or ["units", "out", "--workers", "0"]

    return Case(f"{file}: {name}", "labels", make, expect)


def _planned(words: list[str]) -> list[str]:
    """Plan; return the arguments of a plan that is refused, otherwise an empty list."""
    from malformed.trial import run_command

    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        code = run_command(["plan", *words])
    return ["plan", *words] if code else []


def _labels() -> Iterator[Case]:
    sound = cells_phantom()
    put = tifffile.imwrite
    for name, voxels in {
        "fractions": sound + 0.5, "complex": sound.astype(np.complex64), "-7": sound.astype(np.int16) - 7, "infinite": np.where(sound, np.inf, 0).astype(np.float32),
        "1e30": (sound * 1e30).astype(np.float32), "another shape": sound[:, :-1], "a plane": sound[3], "a plane fewer": sound[:-1], "RGB": np.stack([sound] * 3, -1).astype(np.uint8),
    }.items():  # fmt: skip
        yield _label_map(
            f"of {name}",
            lambda p, v=voxels: put(p, v, photometric="rgb" if v.ndim == 4 else "minisblack"),
        )
    for name, voxels in {
        "-1": np.where(sound, sound.astype(np.int16), -1), "NaN": np.where(sound, sound, np.nan).astype(np.float32), "one object": (sound > 0).astype(np.uint8), "nothing": sound * 0,
        "one object everywhere": np.ones_like(sound), "noise": np.random.default_rng(1).integers(0, 2**32, sound.shape, np.uint32), "2^32-1": np.where(sound, 2**32 - sound.astype(np.int64), 0).astype(np.uint32),
        "threads": np.where(np.indices(sound.shape).sum(0) % 2, 1, 0).astype(np.uint16),
    }.items():  # fmt: skip
        yield _label_map(
            f"of {name}", lambda p, v=voxels: put(p, v, photometric="minisblack"), expect="any"
        )
    for name, top in {"2^63-1": 2**63 - 1, "2^64-1": 2**64 - 1}.items():
        yield _label_map(
            f"of {name}",
            lambda p, t=top: _zarr_labels(
                p, np.where(sound, np.uint64(t) - sound.astype(np.uint64), np.uint64(0))
            ),
            "l.zarr",
            "done",
        )
    yield _label_map(
        "a chunk cut",
        lambda p: (_zarr_labels(p, sound), cut(next(p.glob("0/c/0/0/0")), 0.5)),
        "l.zarr",
    )
    yield _label_map(
        "10^6 each way",
        lambda p: (
            _zarr_labels(p, sound),
            _claim_zarr(zarr.open_group(p, mode="a"), "0", (10**6,) * 3),
        ),
        "l.zarr",
    )
    yield _label_map("is lost", lambda p: None)
    yield _label_map("is a pipe", lambda p: os.mkfifo(p))
    yield _label_map("of text", lambda p: p.write_text("no labels"))
    for name, words in {"name of the channel": ["F=cells.tif"], "twice": ["cells=cells.tif", "cells=cells.tif"], "without a name": ["=cells.tif"], "escape": ["../bait/secret.txt=cells.tif"], "a place outside": ["../../../etc"], "of control characters": ["\x1b[31m=cells.tif"]}.items():  # fmt: skip
        flags = [word for one in words for word in ("--labels", one)]
        yield Case(f"--labels {name}", "labels", partial(_asked, flags=flags), "any")


def _asked(base: Path, folder: Path, flags: list[str]) -> list[str]:
    for one in ("f.ome.tif", _LABELS):
        copied(base, folder, one)
    return ["plan", "f.ome.tif", "-o", "out", *flags]


def _zarr_labels(path: Path, voxels: Any) -> None:
    from support.phantoms import write_ome_zarr

    write_ome_zarr(path, [voxels])


def _segmentations() -> Iterator[Case]:
    for share in (0.0, 0.2, 0.6, 0.97):
        yield _segmentation(f"cut to {share:g}", partial(cut, share=share), "refused")
    for seed in range(8):
        yield _segmentation(
            f"with flipped bits {seed}", partial(flip, seed=seed, count=8, start=132), "any"
        )
    frames = "PerFrameFunctionalGroupsSequence"
    for name, change in {
        "10^6 frames": _set(NumberOfFrames=10**6), "-1 frames": _set(NumberOfFrames=-1), "0 frames": _set(NumberOfFrames=0), "more frames": _set(NumberOfFrames=40), "no frames": lambda d: d.__delattr__("NumberOfFrames"),
        "groups lost": lambda d: d.__delattr__(frames), "groups short": lambda d: d.__setattr__(frames, d[frames].value[:2]), "fractions": _set(SegmentationType="FRACTIONAL"), "a kind nobody knows": _set(SegmentationType="\x1b[31mX"),
        "positions NaN": lambda d: _each_frame(d, lambda f, i: f.PlanePositionSequence[0].__setattr__("ImagePositionPatient", ["nan", 0, 0])),
        "positions alike": lambda d: _each_frame(d, lambda f, i: f.PlanePositionSequence[0].__setattr__("ImagePositionPatient", [0, 0, 0])),
        "positions beside each other": lambda d: _each_frame(d, lambda f, i: f.PlanePositionSequence[0].__setattr__("ImagePositionPatient", [90 * i, 7 * i, i])),
        "positions of 1e30": lambda d: _each_frame(d, lambda f, i: f.PlanePositionSequence[0].__setattr__("ImagePositionPatient", [0, 0, f"{i}e30"])),
        "segments 0": lambda d: _each_frame(d, lambda f, i: f.SegmentIdentificationSequence[0].__setattr__("ReferencedSegmentNumber", 0)),
        "pixels short": lambda d: d.__setattr__("PixelData", d.PixelData[:8]), "pixels empty": _set(PixelData=b""), "rows 0": _set(Rows=0), "rows 65535": _set(Rows=65535, Columns=65535), "3 samples": _set(SamplesPerPixel=3), "bits 16": _set(BitsAllocated=16, BitsStored=16, HighBit=15),
    }.items():  # fmt: skip
        expect = (
            "any"
            if name in ("no frames", "-1 frames", "0 frames", "bits 16", "positions alike")
            else "refused"
        )
        yield _segmentation(name, partial(_change_dicom, change=change), expect)
    for name, change in {
        "fewer frames": _set(NumberOfFrames=2), "segments lost": lambda d: d.__delattr__("SegmentSequence"), "overlap odd": _set(SegmentsOverlap="\x1b"), "overlap a lie": _set(SegmentsOverlap="NO"),
        "a segment of 65535": lambda d: _each_frame(d, lambda f, i: f.SegmentIdentificationSequence[0].__setattr__("ReferencedSegmentNumber", 65535)),
        "number 0": lambda d: d.SegmentSequence[0].__setattr__("SegmentNumber", 0), "numbers alike": lambda d: d.SegmentSequence[1].__setattr__("SegmentNumber", 1),
        "colour short": lambda d: d.SegmentSequence[0].__setattr__("RecommendedDisplayCIELabValue", [1]), "colour of 0": lambda d: d.SegmentSequence[0].__setattr__("RecommendedDisplayCIELabValue", [0, 0, 0]),
        "spacing between NaN": lambda d: d.SharedFunctionalGroupsSequence[0].PixelMeasuresSequence[0].__setattr__("SpacingBetweenSlices", "nan"),
        "spacing between 1e-30": lambda d: d.SharedFunctionalGroupsSequence[0].PixelMeasuresSequence[0].__setattr__("SpacingBetweenSlices", "1e-30"),
    }.items():  # fmt: skip
        yield _segmentation(name, partial(_change_dicom, change=change), "any")
    for name, text in ODD_NAMES.items():
        if name in ("surrogate", "nul"):
            continue

        def rename(ds: Any, text: str = text) -> None:
            for segment in ds.SegmentSequence:
                segment.SegmentLabel = text[:60]
                coded = segment.SegmentedPropertyTypeCodeSequence[0]
                coded.CodeValue = coded.CodeMeaning = coded.CodingSchemeDesignator = text[:16]

        yield _segmentation(f"called {name}", partial(_change_dicom, change=rename), "any")


def _segmentation(name: str, spoil: Callable[[Path], Any], expect: str) -> Case:
    def make(base: Path, folder: Path) -> list[str]:
        spoil(copied(base, folder, "seg.dcm"))
        return _planned(["seg.dcm", "-o", "out", "--labels", "."]) or ["units", "out", "--workers", "0"]  # fmt: skip

    return Case(name, "segmentations", make, expect)


def _set(**values: Any) -> Callable[[Any], None]:
    def change(ds: Any) -> None:
        for name, value in values.items():
            setattr(ds, name, value)

    return change


def _each_frame(ds: Any, change: Callable[[Any, int], Any]) -> None:
    for number, frame in enumerate(ds.PerFrameFunctionalGroupsSequence):
        change(frame, number)


def _change_dicom(path: Path, change: Callable[[Any], Any]) -> None:
    ds = pydicom.dcmread(path)
    with pydicom.config.disable_value_validation():
        change(ds)
        ds.save_as(path)
