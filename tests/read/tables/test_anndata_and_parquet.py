"""Tables of AnnData, SpatialData and Parquet: what is read, and what is refused in one line."""

import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import zarr
from scipy import sparse

from malformed.base import write_anndata
from stereocell.model.errors import SourceError
from stereocell.read.tables import parquet as parquet_tables
from stereocell.read.tables import read_table, stores
from support.tables import refusal


def anndata(path: Path, version: int | str, x: str) -> Path:
    """Write a table in AnnData's format without AnnData; version: that of Zarr, or "h5ad"."""
    if version == "h5ad":
        path.parent.mkdir(parents=True)
        with h5py.File(path, "w") as file:
            fill_anndata(file, x)
    else:
        fill_anndata(zarr.open_group(path, mode="w", zarr_format=version), x)
    return path


def fill_anndata(group: Any, x: str) -> None:
    obs = group.create_group("obs")
    obs.attrs.update(
        {
            "encoding-type": "dataframe",
            "column-order": ["id", "region", "type", "ok"],
            "_index": "_index",
        }
    )

    def put(to: Any, name: str, values: object, kind: str = "array") -> None:
        array = np.asarray(values)
        is_text = array.dtype.kind == "U"
        create = to.create_array if hasattr(to, "create_array") else to.create_dataset
        text = str if hasattr(to, "create_array") else h5py.string_dtype()
        held = create(name, shape=array.shape, dtype=text if is_text else array.dtype)
        held[...] = array.astype(object) if is_text else array
        held.attrs["encoding-type"] = kind

    put(obs, "_index", ["a", "b", "c", "d"], "string-array")
    put(obs, "id", [4, 2, 9, 2])
    region = obs.create_group("region")
    region.attrs["encoding-type"] = "categorical"
    put(region, "codes", np.array([0, 0, 0, 1], np.int8))
    put(region, "categories", ["cells", "nuclei"], "string-array")
    kind = obs.create_group("type")
    kind.attrs["encoding-type"] = "categorical"
    put(kind, "codes", np.array([1, 0, -1, 0], np.int8))
    put(kind, "categories", ["B", "T"], "string-array")
    put(obs, "ok", [True, False, True, True])
    var = group.create_group("var")
    var.attrs["_index"] = "gene"
    put(var, "gene", ["CD8", "CD3"], "string-array")
    dense = np.array([[1, 0], [0, 2.5], [3, 4], [9, 9]], np.float32)
    if x == "dense":
        put(group, "X", dense)
    else:
        made = sparse.csr_array(dense) if x == "csr" else sparse.csc_array(dense)
        held = group.create_group("X")
        held.attrs.update({"encoding-type": f"{x}_matrix", "shape": [4, 2]})
        put(held, "data", made.data)
        put(held, "indices", made.indices)
        put(held, "indptr", made.indptr)
    uns = group.create_group("uns").create_group("spatialdata_attrs")
    put(uns, "region_key", np.array("region"), "string")
    put(uns, "instance_key", np.array("id"), "string")


@pytest.mark.slow
@pytest.mark.parametrize("version", [2, 3, "h5ad"])
@pytest.mark.parametrize("x", ["dense", "csr", "csc"])
def test_a_table_of_spatialdata_is_read(tmp_path: Path, version: int | str, x: str) -> None:
    name = "it's a table.h5ad" if version == "h5ad" else "table"
    path = anndata(tmp_path / "s.zarr" / "tables" / name, version, x)
    table = read_table(str(path), "", (), "cells")
    assert (table.key, table.labels.tolist()) == ("id", [4, 2, 9])  # d is a nucleus
    by_name = {column.name: column for column in table.columns}
    assert list(by_name) == ["type", "ok", "CD8", "CD3"]
    assert by_name["type"].texts == ("T", "B", "")
    np.testing.assert_array_equal(by_name["ok"].numbers, [1, 0, 1])
    np.testing.assert_array_equal(by_name["CD8"].numbers, [1, 0, 3])
    np.testing.assert_array_equal(by_name["CD3"].numbers, [0, 2.5, 4])
    with pytest.raises(SourceError, match="found rows for cells, nuclei, expected some for organs"):
        read_table(str(path), "", (), "organs")


def test_a_zarr_group_without_a_table_is_refused(tmp_path: Path) -> None:
    zarr.open_group(tmp_path / "s.zarr", mode="w")
    assert "found no group `obs`" in refusal(str(tmp_path / "s.zarr"))


@pytest.mark.slow
def test_a_file_of_an_older_anndata_is_refused(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5ad", "w") as file:
        obs = file.create_group("obs")
        obs.attrs["column-order"] = ["id"]
        obs["id"] = [1]
        obs.create_group("__categories")
    assert "in the form before AnnData 0.8" in refusal(str(tmp_path / "a.h5ad"))


@pytest.mark.slow
def test_only_the_requested_genes_are_read(tmp_path: Path) -> None:
    path = str(anndata(tmp_path / "a" / "b.h5ad", "h5ad", "csr"))
    (only,) = read_table(path, "", ("CD3",), "cells").columns
    np.testing.assert_array_equal(only.numbers, [0, 2.5, 4])


@pytest.mark.parametrize(
    ("name", "change", "expected"),
    [
        ("X/indices", lambda a: a.__setitem__(0, 7), "X/indices: found 7, beyond the matrix"),
        (
            "X/indptr",
            lambda a: a.__setitem__(1, 9),
            "X/indptr: found numbers that don't rise from 0 to",
        ),
        ("obs/type/codes", lambda a: a.__setitem__(0, 5), "found codes -1 to 5, expected -1 to 1"),
        ("obs/id", lambda a: a.__setitem__(0, 2), "id: found 2 more than once"),
    ],
)
@pytest.mark.slow
def test_an_h5ad_that_contradicts_itself_is_refused(
    tmp_path: Path, name: str, change: Any, expected: str
) -> None:
    path = anndata(tmp_path / "a" / "b.h5ad", "h5ad", "csr")
    with h5py.File(path, "a") as file:
        change(file[name])
    assert expected in refusal(str(path))


def parquet(tmp_path: Path, **columns: Any) -> str:
    path = tmp_path / "p q's.parquet"
    pq.write_table(pa.table(columns), path)
    return str(path)


@pytest.mark.slow
def test_a_table_of_parquet_is_read(tmp_path: Path) -> None:
    place = parquet(
        tmp_path,
        label=pa.array([2**63 - 1, 2**64 - 1, 5], pa.uint64()),
        CD8=pa.array([1.5, None, -2e3]),
        many=pa.array([1, None, 2**63 - 1], pa.int64()),
        half=pa.array(np.array([1, 2, 3], np.float16)),
        ok=pa.array([True, None, False]),
        kind=pa.array(["T\ncell", "NA", "B"]),
        coded=pa.array(["x", None, "x"]).dictionary_encode(),
        day=pa.array([0, 0, 86400], pa.timestamp("s")),
        none=pa.nulls(3),
        shape=pa.array([b"1", b"2", b"3"]),
        parts=pa.array([[1], [2], [3]]),
        __index_level_0__=pa.array([0, 1, 2]),
    )
    table = read_table(place, "", (), "cells")
    assert (table.key, table.labels.tolist()) == ("label", [2**63 - 1, 2**64 - 1, 5])
    by_name = {column.name: column for column in table.columns}
    assert list(by_name) == ["CD8", "many", "half", "ok", "kind", "coded", "day", "none"]
    np.testing.assert_array_equal(by_name["CD8"].numbers, [1.5, np.nan, -2000])
    np.testing.assert_array_equal(by_name["many"].numbers, [1, np.nan, 2.0**63])
    np.testing.assert_array_equal(by_name["half"].numbers, [1, 2, 3])
    np.testing.assert_array_equal(by_name["ok"].numbers, [1, np.nan, 0])
    assert by_name["kind"].texts == ("T cell", "", "B")
    assert by_name["coded"].texts == ("x", "", "x")
    assert by_name["day"].texts == (
        "1970-01-01 00:00:00.000",
        "1970-01-01 00:00:00.000",
        "1970-01-02 00:00:00.000",
    )
    assert np.isnan(by_name["none"].numbers).all()
    assert "column 'parts': found list<" in refusal(place, "", ("parts",))
    assert "row 2: found None" in refusal(parquet(tmp_path, id=pa.array([1, None])))
    empty = read_table(
        parquet(tmp_path, id=pa.array([], pa.int64()), a=pa.array([], pa.string())), "", (), "c"
    )
    assert (len(empty.labels), empty.columns[0].texts) == (0, ())


@pytest.mark.slow
def test_numbers_that_parquet_stores_as_texts_are_read_as_numbers_and_noted(tmp_path: Path) -> None:
    place = parquet(
        tmp_path,
        label=pa.array([1, 2, 3, 4]),
        area=pa.array(["1.5", "#DIV/0!", None, "7"]),
        comma=pa.array(["1,5", "2,25", "3,5", "4"]),
        cluster=pa.array(["0", "1", "0", "1"]).dictionary_encode(),
        none=pa.array(["NA", None, "-", ""]),
    )
    table = read_table(place, "", (), "cells")
    area, comma, cluster, none = table.columns
    np.testing.assert_array_equal(area.numbers, [1.5, np.nan, np.nan, 7])
    np.testing.assert_array_equal(comma.numbers, [1.5, 2.25, 3.5, 4])
    assert cluster.texts == ("0", "1", "0", "1")
    assert none.texts == ("", "", "-", "")
    joined = " ".join(table.notes)
    assert "numbers stored as texts are read as numbers: 'area', 'comma'" in joined
    assert "area: '#DIV/0!' (1), empty (1)" in joined


@pytest.mark.slow
def test_numbers_that_anndata_stores_as_texts_are_read_as_numbers_and_noted(tmp_path: Path) -> None:
    place = anndata(tmp_path / "a" / "t.h5ad", "h5ad", "dense")
    with h5py.File(place, "r+") as file:
        obs = file["obs"]
        obs.create_dataset("size", data=["1.5", "n.d.", "3", "4"], dtype=h5py.string_dtype())
        obs["size"].attrs["encoding-type"] = "string-array"
        obs.attrs["column-order"] = ["id", "region", "type", "ok", "size"]
    table = read_table(str(place), "", (), "cells")
    size = next(column for column in table.columns if column.name == "size")
    np.testing.assert_array_equal(size.numbers, [1.5, np.nan, 3])
    assert "numbers stored as texts are read as numbers: 'size'" in table.notes


def test_parquet_without_its_library_names_the_command_that_installs_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = parquet(tmp_path, id=pa.array([1]))
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert refusal(place).endswith(': pip install "stereocell[tables]"')


@pytest.mark.slow
def test_a_text_that_a_million_rows_share_is_stored_once(tmp_path: Path) -> None:
    """Decoded to one text per row it would take 2 GB."""
    rows = 20_000
    word = pa.array(["x" * 100_000]).dictionary_encode()
    column = pa.DictionaryArray.from_arrays(pa.array(np.zeros(rows, np.int32)), word.dictionary)
    place = parquet(tmp_path, id=pa.array(np.arange(1, rows + 1)), a=column)
    (found,) = read_table(place, "", (), "cells").columns
    assert found.texts == ("x" * 200,) * rows


@pytest.mark.slow
def test_parquet_on_which_its_library_aborts_is_refused_in_a_line(tmp_path: Path) -> None:
    """The repetition type of a column is 33 instead of 0 to 2. pyarrow 26 aborts on it."""
    place = tmp_path / "a.parquet"
    table = pa.table({"label": [1, 2, 3], "kind": ["T", "B", "T"]})
    pq.write_table(table, place, compression="none")
    content = place.read_bytes()
    assert content.count(b"%\x02\x18\x05label") == 1
    place.write_bytes(content.replace(b"%\x02\x18\x05label", b"%\x42\x18\x05label"))
    assert "expected a complete Parquet file" in refusal(place)


@pytest.mark.slow
def test_an_h5ad_with_floats_of_a_nonstandard_form_is_refused(tmp_path: Path) -> None:
    place = tmp_path / "a.h5ad"
    with h5py.File(place, "w") as file:
        write_anndata(file, h5py.string_dtype())
    ieee = bytes.fromhex("11203f0008000000 00004000 340b0034 ff030000")
    content = place.read_bytes()
    assert ieee in content
    place.write_bytes(content.replace(ieee, ieee[:-5] + b"\x30" + ieee[-4:]))
    assert "expected IEEE floats" in refusal(str(place))


@pytest.mark.slow
def test_an_h5ad_whose_heap_makes_hdf5_loop_without_end_is_refused_at_a_time_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A heap object has 0 bytes, so HDF5 2.0 looks for the next object at the same place."""
    place = tmp_path / "a.h5ad"
    with h5py.File(place, "w") as file:
        write_anndata(file, h5py.string_dtype())
    content = bytearray(place.read_bytes())
    size = content.index(b"CD8\0\0\0\0\0") + 16  # size of the free space after the last object
    content[size : size + 8] = bytes(8)
    place.write_bytes(content)
    monkeypatch.setattr(stores, "_MOST_S", 3.0)
    assert "expected a table of AnnData" in refusal(str(place))


@pytest.mark.slow
def test_a_column_of_parquet_that_exceeds_memory_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(parquet_tables, "_MAX_BYTES", 50_000)
    place = parquet(tmp_path, id=pa.array([1, 2]), a=pa.array(["x" * 60_000, "y"]), b=[1.5, 2])
    assert "column 'a': found 60" in refusal(place)
    (b,) = read_table(place, "", ("b",), "cells").columns
    np.testing.assert_array_equal(b.numbers, [1.5, 2])
