"""Tables with a row per object: what is read from each kind, and what is refused in one line."""

from pathlib import Path

import numpy as np
import pytest

from stereocell.read.tables import read_table
from support.tables import csv, refusal


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
    """Return the values of each column of numbers in a text table, by the column's name."""
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
