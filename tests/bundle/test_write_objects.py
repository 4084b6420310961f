"""The bundle's files of a label map's table agree with values that numpy computes."""

import json
from dataclasses import replace
from hashlib import sha256

import jsonschema
import numpy as np
import pytest

from stereocell.bundle.write_objects import write_objects
from stereocell.model.object_table import Column, ObjectTable
from stereocell.storage.assets import find_asset

RNG = np.random.default_rng(3)
COUNT = 5000
FOLDER = "channels/cells"


def number(name, values, **rest):
    return Column(name, name, np.asarray(values, np.float32), **rest)


NORMAL = RNG.normal(20, 3, COUNT)
LOGNORMAL = RNG.lognormal(6, 1.2, COUNT)
HOLES = np.where(np.arange(COUNT) % 7 == 0, np.nan, NORMAL)
TYPE = Column(
    "cell_type",
    "Cell type",
    (np.arange(COUNT) % 4 - 1).astype(np.float32),
    categories=("T", "B", "tumour"),
    colors=((1, 0, 0), (0, 1, 0), (0, 0, 1)),
)


def table(*columns, labels=None, rows=None, **rest):
    labels = np.arange(1, COUNT + 1) if labels is None else labels
    n = len(labels)
    return ObjectTable(
        np.asarray(labels, np.uint64),
        np.arange(6 * n, dtype=np.float32).reshape(n, 6),
        {"r0_c0": np.arange(n, dtype=np.int32)} if rows is None else rows,
        columns,
        **rest,
    )


def written(tmp_path, given):
    ref, files = write_objects(tmp_path, FOLDER, given)
    assert ref.path == f"{FOLDER}/objects.json"
    content = json.loads((tmp_path / ref.path).read_text("utf-8"))
    schema = json.loads(find_asset("schemas/objects.schema.json").read_text("utf-8"))
    jsonschema.validate(content, schema)
    assert {f.path for f in files} == {
        p.relative_to(tmp_path).as_posix() for p in tmp_path.rglob("*") if p.is_file()
    }
    return content


def load(tmp_path, ref, kind):
    return np.fromfile(tmp_path / ref["path"], dtype=kind)


def column_of(tmp_path, column):
    (entry,) = written(tmp_path, table(column))["columns"]
    return entry, load(tmp_path, entry["bytes"], np.uint8), load(tmp_path, entry["exact"], "<f4")


def decoded(entry, data):
    span = entry["range"]
    share = (data.astype(float) - 1) / 254
    if span["scale"] == "log":
        return span["low"] * (span["high"] / span["low"]) ** share
    return span["low"] + share * (span["high"] - span["low"])


def test_bytes_span_values_except_a_thousandth_at_either_end(tmp_path):
    entry, data, exact = column_of(tmp_path, number("extent", NORMAL))
    assert exact.tobytes() == NORMAL.astype("<f4").tobytes()
    assert (entry["range"]["min"], entry["range"]["max"]) == (exact.min(), exact.max())
    low, high = np.percentile(exact.astype(float), [0.1, 99.9])
    assert (entry["range"]["low"], entry["range"]["high"]) == pytest.approx((low, high))
    assert entry["range"]["scale"] == "linear"
    inside = (exact >= low) & (exact <= high)
    assert inside.sum() >= 0.997 * COUNT
    half_a_step = 0.5 * (high - low) / 254
    assert np.abs(decoded(entry, data) - exact)[inside].max() <= half_a_step * 1.0001
    assert (data[exact < low] == 1).all()
    assert (data[exact > high] == 255).all()


def test_bytes_are_logarithmic_for_values_that_span_decades(tmp_path):
    entry, data, exact = column_of(tmp_path, number("CD8", LOGNORMAL))
    span = entry["range"]
    assert span["scale"] == "log"
    inside = (exact >= span["low"]) & (exact <= span["high"])
    off = np.abs(np.log(decoded(entry, data) / exact))[inside]
    assert off.max() <= 0.5 * np.log(span["high"] / span["low"]) / 254 * 1.0001
    assert 100 < np.median(data) < 156  # bytes resolve the lower and the upper half of the values


@pytest.mark.parametrize(
    "values", [LOGNORMAL - LOGNORMAL.min(), RNG.uniform(1, 100, COUNT), 10_000 + LOGNORMAL]
)
def test_bytes_are_linear_for_zeros_uniform_values_and_narrow_spans(tmp_path, values):
    assert column_of(tmp_path, number("a", values))[0]["range"]["scale"] == "linear"


def test_missing_values_are_byte_0(tmp_path):
    holes = HOLES.copy()
    holes[3] = np.inf
    entry, data, exact = column_of(tmp_path, number("CD8", holes))
    assert ((data == 0) == ~np.isfinite(exact)).all()
    assert entry["known"] == np.isfinite(holes).sum()


def test_a_column_without_a_value_has_no_range(tmp_path):
    entry, data, _ = column_of(tmp_path, number("CD8", np.full(COUNT, np.nan)))
    assert "range" not in entry
    assert entry["known"] == 0
    assert not data.any()


def test_equal_values_are_all_known(tmp_path):
    entry, data, _ = column_of(tmp_path, number("CD8", np.full(COUNT, 7)))
    assert entry["range"]["low"] == entry["range"]["high"] == 7
    assert (data == 1).all()


def test_byte_of_a_category_is_its_index_plus_1(tmp_path):
    entry, data, exact = column_of(tmp_path, TYPE)
    assert entry["kind"] == "category"
    assert entry["categories"] == ["T", "B", "tumour"]
    assert entry["colors"] == [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    assert (data == TYPE.values + 1).all()
    assert entry["known"] == np.count_nonzero(TYPE.values >= 0)
    assert exact.min() == -1


@pytest.mark.parametrize(("largest", "kind", "size"), [(2**32 - 1, "<u4", 4), (2**63, "<u8", 8)])
def test_labels_have_as_many_bytes_as_the_largest_needs(tmp_path, largest, kind, size):
    content = written(tmp_path, table(labels=[1, 5, largest], names=("liver", "spleen", "aorta")))
    assert content["label_bytes"] == size
    assert load(tmp_path, content["labels"], kind).tolist() == [1, 5, largest]
    assert content["names"] == ["liver", "spleen", "aorta"]
    assert load(tmp_path, content["boxes"], "<f4").reshape(3, 6)[2].tolist() == [*range(12, 18)]


def test_an_object_in_two_tiles_has_one_row(tmp_path):
    rows = {"r0_c0": [0, 1, 2, 7], "r0_c1": [3, 4, 1, 0], "r0_c2": [], "r0_c3": [9, 3]}
    rows = {tile: np.array(each, np.int32) for tile, each in rows.items()}
    tiles = written(tmp_path, table(rows=rows))["tiles"]
    for tile, each in rows.items():
        entry = tiles[tile]
        run = [entry["first"] + i for i in range(entry["count"])]
        assert run + entry.get("more", []) == each.tolist()
    assert tiles["r0_c0"] == {"first": 0, "count": 3, "more": [7]}


def test_neighbours_are_listed_for_both_objects(tmp_path):
    interfaces = np.array([[0, 1], [1, 2], [0, 4]], np.int32)
    content = written(tmp_path, table(labels=range(1, 6), interfaces=interfaces))
    first = load(tmp_path, content["neighbours"]["first"], "<u4")
    rows = load(tmp_path, content["neighbours"]["rows"], "<u4")
    found = [rows[first[i] : first[i + 1]].tolist() for i in range(5)]
    assert found == [[1, 4], [0, 2], [1], [], [0]]


def test_ids_that_differ_only_by_case_have_different_files(tmp_path):
    columns = written(tmp_path, table(number("cd8", NORMAL), number("CD8", LOGNORMAL)))["columns"]
    paths = [entry[kind]["path"].lower() for entry in columns for kind in ("bytes", "exact")]
    assert len(set(paths)) == 4


def test_recolouring_20_000_objects_takes_20_kb(tmp_path):
    labels = np.arange(1, 20_001)
    column = number("CD8", RNG.lognormal(5, 1, 20_000))
    (entry,) = written(tmp_path, replace(table(labels=labels), columns=(column,)))["columns"]
    assert entry["bytes"]["bytes"] == 20_000


def test_one_value_of_a_long_column_can_be_read_by_a_verified_range(tmp_path):
    (entry,) = written(tmp_path, table(number("extent", NORMAL)))["columns"]
    data = (tmp_path / entry["exact"]["path"]).read_bytes()
    assert entry["parts"] == [sha256(each).hexdigest() for each in (data[:16384], data[16384:])]
    short = table(number("extent", NORMAL[:4096]), labels=np.arange(4096))
    (entry,) = written(tmp_path / "short", short)["columns"]
    assert "parts" not in entry


def test_a_table_without_objects_is_written(tmp_path):
    content = written(tmp_path, table(number("volume_um3", []), labels=[]))
    assert content["count"] == 0
