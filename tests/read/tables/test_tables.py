"""Tables with a row an object: what is read of each kind, and what is refused, in one line."""

from pathlib import Path

import numpy as np
import pytest
import zarr

from stereocell.model.errors import SourceError
from stereocell.read.tables import read_table


def csv(tmp_path: Path, text: str, name: str = "t.csv") -> str:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return str(path)


def refusal(place: str, key: str = "", wanted: tuple[str, ...] = ()) -> str:
    with pytest.raises(SourceError) as error:
        read_table(place, key, wanted, "cells")
    told = str(error.value)
    assert "\n" not in told
    assert len(told) < 600
    return told


@pytest.mark.parametrize(("mark", "name"), [(",", "t.csv"), ("\t", "t.tsv"), (";", "t.csv")])
def test_numbers_words_and_gaps(tmp_path: Path, mark: str, name: str) -> None:
    lines = ["CellID,CD8,type,empty", "3,1.5,T cell,", "1,NA,B,nan", "7,-2e3,,"]
    table = read_table(csv(tmp_path, "\r\n".join(lines).replace(",", mark), name), "", (), "cells")
    assert (table.key, table.labels.tolist()) == ("CellID", [3, 1, 7])
    cd8, kind, empty = table.columns
    np.testing.assert_array_equal(cd8.numbers, [1.5, np.nan, -2000])
    assert (kind.texts, kind.numbers) == (("T cell", "B", ""), None)
    assert np.isnan(empty.numbers).all()


@pytest.mark.parametrize("key", ["label", "cell_id", "ObjectNumber", "instance_id", "LABEL"])
def test_keys_as_programs_call_them(tmp_path: Path, key: str) -> None:
    table = read_table(csv(tmp_path, f"area,{key}\n5,2.0\n6,4\n"), "", (), "cells")
    assert (table.key, table.labels.tolist()) == (key, [2, 4])
    assert [column.name for column in table.columns] == ["area"]


def test_a_byte_order_mark_quotes_and_names_of_all_kinds(tmp_path: Path) -> None:
    text = '\ufeffCellID,"a,b","../x",ümlaut  \t1\n1,2,3,4\n'
    table = read_table(csv(tmp_path, text), "", (), "cells")
    assert [column.name for column in table.columns] == ["a,b", "../x", "ümlaut 1"]


def test_what_spreadsheets_and_pandas_write(tmp_path: Path) -> None:
    """An index without a name; semicolons with a comma before the fraction; words of two lines."""
    table = read_table(csv(tmp_path, ",CellID,a\n0,4,1.5\n1,5,2\n"), "", (), "cells")
    assert [column.name for column in table.columns] == ["column 1", "a"]
    text = 'label;a;b\n1;1,5;"T\n cell"\n2;0,25;B\n'
    a, b = read_table(csv(tmp_path, text), "", (), "cells").columns
    np.testing.assert_array_equal(a.numbers, [1.5, 0.25])
    assert b.texts == ("T cell", "B")


def test_64_bits(tmp_path: Path) -> None:
    table = read_table(csv(tmp_path, f"label,a\n{2**63 + 1},1\n"), "", (), "cells")
    assert table.labels.tolist() == [2**63 + 1]


def test_columns_by_name_and_many_columns(tmp_path: Path) -> None:
    names = [f"m{i}" for i in range(300)]
    place = csv(tmp_path, "label," + ",".join(names) + "\n1" + ",2" * 300 + "\n")
    table = read_table(place, "", (), "cells")
    assert (len(table.columns), table.left_out) == (128, 172)
    table = read_table(place, "", ("m299", "m3"), "cells")
    assert [column.name for column in table.columns] == ["m299", "m3"]
    assert "no column 'm301', expected one of label, m0," in refusal(place, "", ("m301",))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "found no header"),
        ("a,b\n1,2\n", "no column of the objects' numbers: found a, b; expected CellID, label"),
        ("label,a\n1,2\n1,3\n", "label: found 1 more than once (1 in all)"),
        ("label,a\n1.5,2\n", "label, row 1: found 1.5, expected a number of an object"),
        ("label,a\n0,2\n", "label, row 1: found 0, expected"),
        ("label,a\n-3,2\n", "label, row 1: found -3, expected"),
        ("label,a\n1e400,2\n", "label, row 1: found 1e400, expected"),
        ("label,a\nx\n", "line 2: found 1 cells, expected 2"),
        ("label,a\n1,2,3\n", "line 2: found 3 cells, expected 2"),
        ("label,a,a\n1,2,3\n", "found columns twice (a)"),
        ("label,a\n1," + "x" * 200_000 + "\n", "expected rows of cells of at most 131072"),
        (",".join(f"c{i}" for i in range(100_001)) + "\n", "found 100001 columns"),
    ],
)
def test_what_is_no_table(tmp_path: Path, text: str, told: str) -> None:
    assert told in refusal(csv(tmp_path, text))


def test_other_files(tmp_path: Path) -> None:
    (tmp_path / "b.csv").write_bytes(b"label,a\n1,\xff\xfe\n")
    assert "no text" in refusal(str(tmp_path / "b.csv"))
    assert "can't be read (No such file" in refusal(str(tmp_path / "none.csv"))
    assert "unknown kind of table" in refusal(csv(tmp_path, "x", "t.parquet"))
    assert "no column 'k', expected one of label, a" in refusal(
        csv(tmp_path, "label,a\n1,2\n"), "k"
    )


def anndata(path: Path, version: int, x: str) -> Path:
    """Write a table as AnnData's format says, without AnnData."""
    group = zarr.open_group(path, mode="w", zarr_format=version)
    obs = group.create_group("obs")
    obs.attrs.update(
        {
            "encoding-type": "dataframe",
            "column-order": ["id", "region", "type", "ok"],
            "_index": "_index",
        }
    )

    def put(to: zarr.Group, name: str, values: object, kind: str = "array") -> None:
        array = np.asarray(values)
        is_text = array.dtype.kind == "U"
        held = to.create_array(name, shape=array.shape, dtype=str if is_text else array.dtype)
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
        held = group.create_group("X")
        held.attrs.update({"encoding-type": "csr_matrix", "shape": [4, 2]})
        put(held, "data", dense[dense != 0])
        put(held, "indices", np.array([0, 1, 0, 1, 0, 1], np.int32))
        put(held, "indptr", np.array([0, 1, 2, 4, 6], np.int32))
    uns = group.create_group("uns").create_group("spatialdata_attrs")
    put(uns, "region_key", np.array("region"), "string")
    put(uns, "instance_key", np.array("id"), "string")
    return path


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("x", ["dense", "sparse"])
def test_a_table_of_spatialdata(tmp_path: Path, version: int, x: str) -> None:
    path = anndata(tmp_path / "s.zarr" / "tables" / "table", version, x)
    table = read_table(str(path), "", (), "cells")
    assert (table.key, table.labels.tolist()) == ("id", [4, 2, 9])  # d is a nucleus
    by_name = {column.name: column for column in table.columns}
    assert list(by_name) == ["type", "ok", "CD8", "CD3"]
    assert by_name["type"].texts == ("T", "B", "")
    np.testing.assert_array_equal(by_name["ok"].numbers, [1, 0, 1])
    np.testing.assert_array_equal(by_name["CD8"].numbers, [1, 0, 3])
    np.testing.assert_array_equal(by_name["CD3"].numbers, [0, 2.5, 4])
    with pytest.raises(SourceError, match="rows of cells, nuclei, expected some of organs"):
        read_table(str(path), "", (), "organs")


def test_a_zarr_group_without_a_table(tmp_path: Path) -> None:
    zarr.open_group(tmp_path / "s.zarr", mode="w")
    assert "found no `obs`" in refusal(str(tmp_path / "s.zarr"))
