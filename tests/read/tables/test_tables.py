"""Tables with a row per object: what is read from each kind, and what is refused in one line."""

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


def csv(tmp_path: Path, text: str, name: str = "t.csv") -> str:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return str(path)


def refusal(place: str, key: str = "", wanted: tuple[str, ...] = ()) -> str:
    with pytest.raises(SourceError) as error:
        read_table(place, key, wanted, "cells")
    message = str(error.value)
    assert "\n" not in message
    assert len(message) < 600
    return message


@pytest.mark.parametrize(("mark", "name"), [(",", "t.csv"), ("\t", "t.tsv"), (";", "t.csv")])
def test_numbers_words_and_gaps_are_read(tmp_path: Path, mark: str, name: str) -> None:
    lines = ["CellID,CD8,type,empty", "3,1.5,T cell,", "1,NA,B,nan", "7,-2e3,,"]
    table = read_table(csv(tmp_path, "\r\n".join(lines).replace(",", mark), name), "", (), "cells")
    assert (table.key, table.labels.tolist()) == ("CellID", [3, 1, 7])
    cd8, kind, empty = table.columns
    np.testing.assert_array_equal(cd8.numbers, [1.5, np.nan, -2000])
    assert (kind.texts, kind.numbers) == (("T cell", "B", ""), None)
    assert np.isnan(empty.numbers).all()


@pytest.mark.parametrize("key", ["label", "cell_id", "ObjectNumber", "instance_id", "LABEL"])
def test_key_columns_are_found_by_the_names_that_programs_use(tmp_path: Path, key: str) -> None:
    table = read_table(csv(tmp_path, f"area,{key}\n5,2.0\n6,4\n"), "", (), "cells")
    assert (table.key, table.labels.tolist()) == (key, [2, 4])
    assert [column.name for column in table.columns] == ["area"]


def test_a_byte_order_mark_quotes_and_odd_names_are_read(tmp_path: Path) -> None:
    text = '\ufeffCellID,"a,b","../x",ümlaut  \t1\n1,2,3,4\n'
    table = read_table(csv(tmp_path, text), "", (), "cells")
    assert [column.name for column in table.columns] == ["a,b", "../x", "ümlaut 1"]


def test_tables_of_spreadsheets_and_pandas_are_read(tmp_path: Path) -> None:
    """An index without a name; semicolons with a decimal comma; words in two lines."""
    table = read_table(csv(tmp_path, ",CellID,a\n0,4,1.5\n1,5,2\n"), "", (), "cells")
    assert [column.name for column in table.columns] == ["column 1", "a"]
    text = 'label;a;b\n1;1,5;"T\n cell"\n2;0,25;B\n'
    a, b = read_table(csv(tmp_path, text), "", (), "cells").columns
    np.testing.assert_array_equal(a.numbers, [1.5, 0.25])
    assert b.texts == ("T cell", "B")


def numbers(tmp_path: Path, text: str, name: str = "t.csv") -> dict[str, list[float]]:
    """Return the number columns of a text table."""
    table = read_table(csv(tmp_path, text, name), "", (), "cells")
    return {c.name: c.numbers.tolist() for c in table.columns if c.numbers is not None}


def notes(tmp_path: Path, text: str) -> str:
    return " ".join(read_table(csv(tmp_path, text), "", (), "cells").notes)


ERRORS = [
    "#DIV/0!",
    "#N/A",
    "-",
    "n.d.",
    "Inf",
    "-inf",
    "NaN",
    "",
    " ",
    "#NUM!",
    "\u2013",
    "1.#INF",
]


@pytest.mark.parametrize("word", [*ERRORS, "failed", "out of range"])
def test_words_among_numbers_are_missing_values_and_are_quoted(tmp_path: Path, word: str) -> None:
    rows = [f"{label},{label / 2}" for label in range(1, 20)]
    text = "\n".join(["label,area", f"20,{word}", *rows])
    (area,) = numbers(tmp_path, text).values()
    assert np.isnan(area[0])
    assert area[1:] == [label / 2 for label in range(1, 20)]
    quoted = repr(word.strip()) if word.strip() else "empty"
    assert f"1 cell in columns of numbers read as missing values: area: {quoted} (1)" in notes(
        tmp_path, text
    )


def test_a_column_with_many_words_holds_categories(tmp_path: Path) -> None:
    cells = ["1", "2", "tumour", "stroma", "3", "tumour", "tumour"]
    text = "label,zone\n" + "".join(f"{i},{cell}\n" for i, cell in enumerate(cells, start=1))
    (zone,) = read_table(csv(tmp_path, text), "", (), "cells").columns
    note = (
        "column 'zone': 3 of 7 cells are numbers, others are words such as 'tumour': read as texts"
    )
    assert (zone.texts, notes(tmp_path, text)) == (tuple(cells), note)


@pytest.mark.parametrize(("share", "is_number"), [(0.45, True), (0.55, False)])
def test_up_to_half_of_the_cells_may_be_words_where_numbers_have_fractions(
    tmp_path: Path, share: float, is_number: bool
) -> None:
    cells = ["missing" if i < share * 20 else f"{i}.5" for i in range(20)]
    text = "label,area\n" + "".join(f"{i},{cell}\n" for i, cell in enumerate(cells, start=1))
    (area,) = read_table(csv(tmp_path, text), "", (), "cells").columns
    assert (area.numbers is not None) is is_number
    assert ("'missing' (9)" if is_number else "9 of 20 cells are numbers") in notes(tmp_path, text)


@pytest.mark.parametrize(
    ("unit", "mark"), [(" %", "."), ("%", ","), ("\u00b5m", "."), (" um\u00b2", ",")]
)
def test_a_unit_after_each_number_is_left_out_and_noted(
    tmp_path: Path, unit: str, mark: str
) -> None:
    text = f"label;a\n1;12{mark}5{unit}\n2;3{mark}25{unit}\n3;\n4;7{mark}0{unit}\n5;n/a\n"
    expected = [12.5, 3.25, np.nan, 7, np.nan]
    assert numbers(tmp_path, text)["a"] == pytest.approx(expected, nan_ok=True)
    note = f"column 'a': the unit {unit.strip()!r} after the numbers is left out"
    assert note in notes(tmp_path, text)


def test_a_number_that_often_stands_for_missing_values_is_named(tmp_path: Path) -> None:
    note = "column 'a': -9999 in 2 cells is read as a number"
    assert note in notes(tmp_path, "label,a\n1,-9999\n2,3\n3,-9999\n")
    assert notes(tmp_path, "label,depth\n1,-9999\n2,-9000\n3,-200\n") == ""


def test_numbers_of_several_units_stay_texts_and_are_noted(tmp_path: Path) -> None:
    text = "label,a\n1,12 um\n2,3 mm\n3,5 um\n"
    (column,) = read_table(csv(tmp_path, text), "", (), "cells").columns
    assert column.texts == ("12 um", "3 mm", "5 um")
    assert "the numbers have several units ('um', 'mm'): read as texts" in notes(tmp_path, text)
    wells = "label,well\n1,1A\n2,2B\n3,3A\n"  # names that begin with a digit are not numbers
    assert notes(tmp_path, wells) == ""


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("label;a\n1;99.250,00\n2;5,5\n", [99250, 5.5]),  # German
        ("label;a\n1;1.234.567\n2;0,5\n", [1234567, 0.5]),
        ("label;a\n1;99\u202f250,5\n2;5\n", [99250.5, 5]),  # French
        ("label,a\n1,99'250.5\n2,5\n", [99250.5, 5]),  # Swiss
        ('label,a\n1,"99,250.5"\n2,5\n', [99250.5, 5]),  # English
        ('label,a\n1,"0,125"\n2,"1,5"\n', [0.125, 1.5]),
        ("label\ta\n1\t0,125\n2\t-1,5e-3\n", [0.125, -0.0015]),
        ("label;a\n1;1.234\n2;5.5\n", [1.234, 5.5]),  # pandas with sep=";"
        ("label;a\n1;\u22121,5\n2;+2,5\n", [-1.5, 2.5]),
    ],
)
def test_decimal_marks_and_marks_between_thousands_are_recognised(
    tmp_path: Path, text: str, expected: list[float]
) -> None:
    assert numbers(tmp_path, text) == {"a": expected}


@pytest.mark.parametrize("cell", ["99.250,5", "99\u202f250,5", "99'250,5"])
def test_marks_between_thousands_are_noted(tmp_path: Path, cell: str) -> None:
    found = notes(tmp_path, f"label;a;b\n1;{cell};1,5\n2;5,5;2\n")
    assert f"marks between thousands are left out: {cell} is 99250.5" in found
    once = notes(tmp_path, 'label,a\n1,"2,001"\n2,"3,002"\n')  # the note names the number itself
    assert once.count("2,001 is 2001") + once.count("3,002 is 3002") == 1
    assert "thousands" not in notes(tmp_path, "label;a\n1;0,125\n2;12,5\n3;5\n")
    assert "thousands" not in notes(tmp_path, "label,a,b\n1,0.125,7\n2,12.5,100\n")


def test_a_mark_that_other_cells_do_not_explain_is_noted(tmp_path: Path) -> None:
    text = "label;count;area\n1;1.234;0,5\n2;5.678;1,5\n"
    assert numbers(tmp_path, text)["count"] == [1234, 5678]
    assert "'count': not stated, a comma (1.234 is 1234) is assumed, as in other" in notes(
        tmp_path, text
    )
    text = 'label,count\n1,"1,234"\n2,"5,678"\n'
    assert numbers(tmp_path, text)["count"] == [1234, 5678]
    assert "a point (1,234 is 1234) is assumed, since no other cell" in notes(tmp_path, text)
    text = "label;word;a\n1;x, y;1.234\n2;z;5.678\n"
    assert numbers(tmp_path, text)["a"] == [1.234, 5.678]
    assert "'a': not stated, a point (1.234 is 1.234) is assumed" in notes(tmp_path, text)
    assert notes(tmp_path, "label;a;b\n1;1.234;0.5\n2;5.678;1.5\n") == ""


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-8-sig", "cp1252"])
def test_encodings_of_spreadsheets_are_recognised(tmp_path: Path, encoding: str) -> None:
    text = "label\tvolume (\u00b5m\u00b3)\tkind\r\n1\t2,5\tgr\u00fcn\r\n"
    (tmp_path / "t.csv").write_bytes(text.encode(encoding))
    table = read_table(str(tmp_path / "t.csv"), "", (), "cells")
    volume, kind = table.columns
    assert (volume.name, kind.texts) == ("volume (\u00b5m\u00b3)", ("gr\u00fcn",))
    assert any("Windows-1252 is assumed" in note for note in table.notes) == (encoding == "cp1252")


@pytest.mark.parametrize(
    ("before", "expected"),
    [
        ("\nVolume\n====================\n", "in line 4"),  # Imaris
        ("sep=;\n", ""),
        ("# written on a Monday\n\n", "in line 3"),
        ("Image;Cells;Cells;Cells\n", "in line 2"),  # CellProfiler
        ("Pixel size;0.25\nDate;1.5.2024\n", "in line 3"),
    ],
)
def test_lines_before_the_header_are_left_out(tmp_path: Path, before: str, expected: str) -> None:
    text = before + "Volume;Unit;ID;\n0.5;um^3;3;\n1.5;um^3;4;\n;;;\n"
    table = read_table(csv(tmp_path, text), "", (), "cells")
    assert (table.key, table.labels.tolist()) == ("ID", [3, 4])
    assert [column.name for column in table.columns] == ["Volume", "Unit"]
    assert (expected in " ".join(table.notes)) if expected else not table.notes


def test_repeated_column_names_are_preceded_by_their_group(tmp_path: Path) -> None:
    text = "Image,Cells,Nuclei\nObjectNumber,Area,Area\n1,2,3\n"
    assert numbers(tmp_path, text) == {"Cells Area": [2], "Nuclei Area": [3]}


def test_a_table_of_imagej_uses_its_unnamed_column_as_key(tmp_path: Path) -> None:
    place = csv(tmp_path, " ,Label,Mean\n1,cells.tif:1,5.5\n2,cells.tif:2,6\n")
    assert "--table-key 'column 1' takes the first column" in refusal(place)
    table = read_table(place, "column 1", (), "cells")
    assert (table.labels.tolist(), [c.name for c in table.columns]) == ([1, 2], ["Label", "Mean"])


def test_a_row_of_data_is_never_taken_for_the_header(tmp_path: Path) -> None:
    assert "no column holds the objects' numbers: found a, b" in refusal(
        csv(tmp_path, "a,b\n1,2\nid,label\n")
    )


@pytest.mark.parametrize("ending", ["", ".0", ".", "e0", ",0"])
def test_numbers_of_64_bits_are_read_exactly(tmp_path: Path, ending: str) -> None:
    """Programs write whole numbers as real ones too; float64 would round these."""
    text = f"label;a\n{2**63 + 1}{ending};1\n{2**53 + 1}{ending};2\n"
    table = read_table(csv(tmp_path, text), "", (), "cells")
    assert table.labels.tolist() == [2**63 + 1, 2**53 + 1]


def test_columns_are_chosen_by_name_and_limited_in_number(tmp_path: Path) -> None:
    names = [f"m{i}" for i in range(300)]
    place = csv(tmp_path, "label," + ",".join(names) + "\n1" + ",2" * 300 + "\n")
    table = read_table(place, "", (), "cells")
    assert (len(table.columns), table.left_out) == (128, 172)
    table = read_table(place, "", ("m299", "m3"), "cells")
    assert [column.name for column in table.columns] == ["m299", "m3"]
    assert "no column 'm301', expected one of label, m0," in refusal(place, "", ("m301",))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "found no header"),
        ("a,b\n1,2\n", "no column holds the objects' numbers: found a, b, expected CellID, label"),
        ("label,a\n1,2\n1,3\n", "label: found 1 more than once (1 in all)"),
        ("label,a\n1.5,2\n", "label, row 1: found 1.5, expected an object's number"),
        ("label,a\n0,2\n", "label, row 1: found 0, expected"),
        ("label,a\n-3,2\n", "label, row 1: found -3, expected"),
        ("label,a\n1e400,2\n", "label, row 1: found 1e400, expected"),
        ("label,a\n1e999999999,2\n", "label, row 1: found 1e999999999, expected"),
        ("label,a\n1." + "0" * 40 + "1,2\n", "label, row 1: found 1.000"),
        ("label,a\ninf,2\n", "label, row 1: found inf, expected"),
        ("label,a\nx\n", "line 2: found 1 cells, expected 2"),
        ("label,a\n1,2,3\n", "line 2: found 3 cells, expected 2"),
        ("label,a,a\n1,2,3\n", "found columns twice (a)"),
        ("label,a\n1," + "x" * 200_000 + "\n", "expected rows of cells of at most 131072"),
        (",".join(f"c{i}" for i in range(100_001)) + "\n", "found 100001 columns"),
    ],
)
def test_a_text_that_is_not_a_table_is_refused(tmp_path: Path, text: str, expected: str) -> None:
    assert expected in refusal(csv(tmp_path, text))


def test_files_of_other_kinds_are_refused(tmp_path: Path) -> None:
    (tmp_path / "b.csv").write_bytes(b"label,a\n1,\xff\xfe\n")
    assert "bytes that are not text" in refusal(str(tmp_path / "b.csv"))
    assert "can't be read (No such file" in refusal(str(tmp_path / "none.csv"))
    assert "unknown kind of table" in refusal(csv(tmp_path, "x", "t.xlsx"))
    text = csv(tmp_path, "x" * 99, "t.parquet")
    assert refusal(text) == f"{text}: found a text file, expected Parquet"
    assert "found a text file, expected HDF5" in refusal(csv(tmp_path, "x", "t.h5ad"))
    assert "found a pointer of Git LFS" in refusal(
        csv(tmp_path, "version https://git-lfs.github.com/spec/v1\n")
    )
    assert "found an address, expected a file on this machine" in refusal(
        "https://example.org/t.parquet"
    )
    assert "no column 'k', expected one of label, a" in refusal(
        csv(tmp_path, "label,a\n1,2\n"), "k"
    )


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
    assert refusal(place).endswith('is not installed: pip install "stereocell[tables]"')


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
