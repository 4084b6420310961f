"""Imaging Data Commons: its index and its buckets.

The answers follow the documentation of the Commons' API (version 3, POST /sql) and of ListObjectsV2
of S3; none was recorded.
"""

import os
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import pytest

from stereocell import api, read
from stereocell.model.errors import SourceError, StereoCellError, UsageError
from stereocell.read.addresses import idc
from stereocell.read.addresses.resolve import resolve
from support.dicom_series import grid, write_series
from support.recorded_service import Answer, Service

UUID = "0a1b2c3d-1111-4222-8333-444455556666"
STUDY, SERIES = "1.3.6.1.4.1.14519.5.2.1.1", "1.3.6.1.4.1.14519.5.2.1.2"
VIEWER = "https://viewer.imaging.datacommons.cancer.gov"

LAUGHS = (
    "<!DOCTYPE a [<!ENTITY a0 'aaaaaaaaaa'>"
    + "".join(f"<!ENTITY a{n + 1} '{f'&a{n};' * 10}'>" for n in range(9))
    + "]><a><Contents><Key>&a9;</Key></Contents></a>"
).encode()  # 10 GB of one letter


def listing(sizes: dict[str, Any], *, token: str = "") -> bytes:
    items = "".join(
        f"<Contents><Key>{escape(key)}</Key><Size>{size}</Size></Contents>"
        for key, size in sizes.items()
    )
    more = f"<NextContinuationToken>{token}</NextContinuationToken>" if token else ""
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<ListBucketResult xmlns="http://s3.amazonaws.com/doc/2006-03-01/">'
        f"<IsTruncated>{str(bool(token)).lower()}</IsTruncated>{items}{more}</ListBucketResult>"
    ).encode()


@pytest.fixture
def files(tmp_path: Path) -> dict[str, bytes]:
    folder = tmp_path / "written"
    folder.mkdir()
    paths = write_series(folder, grid("axial", (6, 20, 24)), (6, 20, 24))
    names = (f"{n:08x}-aaaa-4bbb-8ccc-ddddeeeeffff.dcm" for n in range(len(paths)))
    return {f"{UUID}/{name}": path.read_bytes() for name, path in zip(names, paths, strict=True)}


@pytest.fixture
def commons(service: Service, files: dict[str, bytes], monkeypatch: pytest.MonkeyPatch) -> Service:
    """The index and the bucket `idc-open-data-two`, which lists three objects at a time."""
    monkeypatch.setattr(idc, "API", f"{service.url}/v3")
    monkeypatch.setattr(idc, "BUCKET", f"{service.url}/{{bucket}}")
    row = {"aws_bucket": "idc-open-data-two", "crdc_series_uuid": UUID}
    service.json("/v3/sql", {"columns": list(row), "rows": [row]})
    sizes = {key: len(content) for key, content in files.items()}
    keys = sorted(sizes)
    asked = f"/idc-open-data-two/?list-type=2&prefix={UUID}%2F"
    service.put(asked, listing({key: sizes[key] for key in keys[:3]}, token="a+b/c="))
    service.put(
        f"{asked}&continuation-token=a%2Bb%2Fc%3D", listing({key: sizes[key] for key in keys[3:]})
    )
    for key, content in files.items():
        service.put(f"/idc-open-data-two/{key}", content)
    return service


@pytest.mark.parametrize(
    "address",
    [
        f"s3://idc-open-data-two/{UUID}/",
        f"s3://idc-open-data-two/{UUID}",
        f"s3://idc-open-data-two/{UUID}/*",
        f"https://idc-open-data-two.s3.amazonaws.com/{UUID}/",
        f"{VIEWER}/viewer/{STUDY}?seriesInstanceUID={SERIES}",
        f"{VIEWER}/v3/viewer/?StudyInstanceUIDs={STUDY}&SeriesInstanceUIDs={SERIES}",
        f"{VIEWER}/v3/viewer/?StudyInstanceUIDs={STUDY}&initialSeriesInstanceUID={SERIES}",
        f"{VIEWER}/slim/studies/{STUDY}/series/{SERIES}",
    ],
)
def test_a_series_is_read_like_its_files(commons: Service, tmp_path: Path, address: str) -> None:
    dataset, files = api.open_volume(address), read.open(tmp_path / "written")
    assert dataset.fingerprint == files.fingerprint
    (note,) = resolve(address).notes
    assert f"series {UUID} (6 files) of s3://idc-open-data-two" in note
    assert STUDY not in note


def test_the_index_is_queried_by_series(commons: Service) -> None:
    resolve(f"{VIEWER}/v3/viewer/?StudyInstanceUIDs={STUDY}&SeriesInstanceUIDs={SERIES}")
    assert f"SeriesInstanceUID = '{SERIES}'" in commons.asked[0].body.decode()


def test_a_link_to_a_study_of_one_series_is_enough(commons: Service) -> None:
    resolve(f"{VIEWER}/viewer/{STUDY}")
    assert f"StudyInstanceUID = '{STUDY}'" in commons.asked[0].body.decode()


def test_files_are_named_by_numbers_and_are_private(commons: Service) -> None:
    folder = Path(resolve(f"s3://idc-open-data-two/{UUID}/").source)
    assert sorted(os.listdir(folder)) == [f"{n:06d}.dcm" for n in range(1, 7)]
    assert folder.parent.stat().st_mode & 0o77 == 0


@pytest.mark.parametrize(
    "address",
    [
        f"{VIEWER}/viewer/{STUDY}?seriesInstanceUID={SERIES},1.2.3",
        f"{VIEWER}/",
        f"{VIEWER}/v3/viewer/?StudyInstanceUIDs='; DROP TABLE index; --",
        f"{VIEWER}/v3/viewer/?StudyInstanceUIDs={STUDY}&SeriesInstanceUIDs=1.2' OR '1'='1",
        "https://portal.imaging.datacommons.cancer.gov/explore/",
        "s3://idc-open-data/",
        f"s3://idc-open-data/{UUID}/../{UUID}/",
        f"s3://idc-open-data/{UUID}/a.dcm",
        "https://idc-open-data.s3.amazonaws.com/",
    ],
)
def test_an_unknown_form_is_refused_with_the_known_ones(commons: Service, address: str) -> None:
    with pytest.raises(UsageError, match="expected"):
        resolve(address)
    assert commons.asked == []


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ({"rows": []}, "does not have the series"),
        ({"rows": [{}, {}]}, "a study of 2 series"),
        ({"rows": [{"aws_bucket": "evil", "crdc_series_uuid": UUID}]}, "found evil/"),
        (
            {"rows": [{"aws_bucket": "idc-open-data", "crdc_series_uuid": "../../x"}]},
            "found idc-open-data/../../x",
        ),
        ({"rows": [None]}, "a public bucket and a UUID"),
        ({"detail": "syntax"}, "found no rows"),
        ([], "found no rows"),
    ],
)
def test_a_bad_answer_of_the_index_is_refused_in_one_line(
    commons: Service, answer: Any, words: str
) -> None:
    commons.json("/v3/sql", answer)
    with pytest.raises(StereoCellError) as caught:
        resolve(f"{VIEWER}/viewer/{STUDY}")
    assert words in str(caught.value)
    assert len(commons.asked) == 1


@pytest.mark.parametrize(
    ("body", "words"),
    [
        (listing({}), "no such series"),
        (b"<html><body>moved<br></html>", "found no XML"),
        (LAUGHS, "found no XML"),
        (listing({f"{UUID}/../../etc/passwd": 9}), "expected UUID/NAME.dcm"),
        (listing({f"{UUID}/..%2Fa.dcm": 9}), "expected UUID/NAME.dcm"),
        (listing({"a.dcm": 9}), "expected UUID/NAME.dcm"),
        (listing({f"{UUID.replace('0a', '0b')}/a.dcm": 9}), "expected UUID/NAME.dcm"),
        (listing({f"{UUID}/a.dcm": "-1"}), "expected UUID/NAME.dcm"),
        (listing({f"{UUID}/a.dcm": 1 << 40}), "at most 100,000 files and 16 GiB"),
        (listing({f"{UUID}/{n}.dcm": 1 for n in range(100_001)}), "at most 100,000 files"),
        (listing({f"{UUID}/missing.dcm": 9}), "HTTP 404"),
    ],
)
def test_a_bad_listing_is_refused_in_one_line(commons: Service, body: bytes, words: str) -> None:
    commons.put(f"/idc-open-data/?list-type=2&prefix={UUID}%2F", body)
    with pytest.raises(SourceError) as caught:
        resolve(f"s3://idc-open-data/{UUID}/")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "length", "words"),
    [
        (b"x" * 400, None, "DICOM file"),
        (b"<html>", None, "a web page"),
        (bytes(128) + b"DICM" + bytes(900), None, "a larger file"),
        (bytes(128) + b"DICM", 200, "cut off"),
    ],
)
def test_a_bad_file_leaves_no_files(
    commons: Service,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    content: bytes,
    length: int | None,
    words: str,
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    before = set(os.listdir(tmp_path))
    commons.put(f"/idc-open-data/?list-type=2&prefix={UUID}%2F", listing({f"{UUID}/a.dcm": 400}))
    commons.answers[f"/idc-open-data/{UUID}/a.dcm"] = Answer(content, length=length)
    with pytest.raises(SourceError, match=words):
        resolve(f"s3://idc-open-data/{UUID}/")
    assert set(os.listdir(tmp_path)) == before
