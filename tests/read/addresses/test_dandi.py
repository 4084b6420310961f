"""DANDI: assets by their UUID, and by their path in a dandiset.

The answers follow the archive's API (its OpenAPI page) and the metadata of an asset that the
archive shows; none was recorded.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stereocell import api, read
from stereocell.model.errors import SourceError, StereoCellError, UsageError
from stereocell.read.addresses import dandi
from stereocell.read.addresses.resolve import resolve
from support.dicom_series import write_f_nifti
from support.phantoms import f_phantom
from support.recorded_service import Answer, Service

ASSET, ZARR = "bc578d52-8fc0-4973-b4a9-5f296d2f133c", "acfaff07-8d4d-4fc1-adce-c769579c5c61"
PATH = "sub-MITU01/micr/sub-MITU01_stain-LEC_SPIM.ome.zarr"
PAGE = "https://dandiarchive.org/dandiset"


def metadata(service: Service, *, path: str = PATH, kind: str = "application/x-zarr") -> Any:
    data = f"zarr/{ZARR}/" if path.endswith(".zarr") else f"blobs/acf/aff/{ZARR}"
    return {
        "schemaKey": "Asset",
        "encodingFormat": kind,
        "path": path,
        "identifier": ASSET,
        "contentUrl": [
            f"https://api.dandiarchive.org/api/assets/{ASSET}/download/",
            f"{service.url}/data/{data}",
        ],
    }


@pytest.fixture
def archive(service: Service, monkeypatch: pytest.MonkeyPatch) -> Service:
    """The archive with dandiset 000108, whose draft has two assets."""
    monkeypatch.setattr(dandi, "API", f"{service.url}/api")
    monkeypatch.setattr(dandi, "DATA", (f"{service.url}/data",))
    service.json(f"/api/assets/{ASSET}/", metadata(service))
    service.json("/api/dandisets/000108/", {"most_recent_published_version": None})
    rows = [
        {"asset_id": ASSET, "path": PATH, "zarr": ZARR, "blob": None},
        {"asset_id": ZARR, "path": "sub-MITU01/micr/sub-MITU01_SPIM.json", "blob": ZARR},
    ]
    service.json("/api/dandisets/000108/versions/draft/assets/", {"count": 2, "results": rows})
    return service


@pytest.mark.parametrize(
    "address",
    [
        f"https://api.dandiarchive.org/api/assets/{ASSET}/",
        f"https://api.dandiarchive.org/api/assets/{ASSET}",
        f"https://api.dandiarchive.org/api/assets/{ASSET}/download/",
        f"https://api.dandiarchive.org/api/dandisets/000108/versions/draft/assets/{ASSET}/download/",
        f"{PAGE}/000108/draft/files?location={PATH}",
        f"{PAGE}/000108/draft/files?location=sub-MITU01%2Fmicr&page=1",
        f"{PAGE}/000108/draft",
        f"{PAGE}/000108",
        f"https://gui.dandiarchive.org/#/dandiset/000108/draft/files?location={PATH}",
    ],
)
def test_each_form_leads_to_the_zarr(archive: Service, address: str) -> None:
    found = resolve(address)
    assert found.source == f"{archive.url}/data/zarr/{ZARR}/"
    assert found.notes == (f"DANDI asset {ASSET} is read from {found.source}",)


@pytest.mark.slow
def test_the_zarr_is_read(archive: Service, tiny_zarr_04: Path) -> None:
    """Its address has no ending that shows the format."""
    for file in tiny_zarr_04.rglob("*"):
        if file.is_file():
            name = file.relative_to(tiny_zarr_04).as_posix()
            archive.put(f"/data/zarr/{ZARR}/{name}", file.read_bytes())
    dataset = api.open_volume(f"https://api.dandiarchive.org/api/assets/{ASSET}/")
    assert dataset.fingerprint == read.open(tiny_zarr_04).fingerprint


def test_a_nifti_is_fetched(archive: Service, tmp_path: Path) -> None:
    path = tmp_path / "f.nii.gz"
    write_f_nifti(path, f_phantom(), (500.0, 400.0, 300.0))
    archive.json(
        f"/api/assets/{ASSET}/",
        metadata(archive, path="sub-01/anat/sub-01_T1w.nii.gz", kind="application/x-nifti"),
    )
    archive.put(f"/data/blobs/acf/aff/{ZARR}", path.read_bytes())
    address = f"https://api.dandiarchive.org/api/assets/{ASSET}/"
    one, other = api.open_volume(address), read.open(path)
    np.testing.assert_array_equal(
        one.read(0, one.levels[0].box).voxels, other.read(0, other.levels[0].box).voxels
    )
    found = resolve(address)
    assert Path(found.source).name == "asset.nii.gz"
    assert "temporary folder" in found.notes[0]
    assert "sub-01" not in str(found)


def test_the_newest_published_version_is_taken(archive: Service) -> None:
    newest = {"most_recent_published_version": {"version": "0.240101.0900"}}
    archive.json("/api/dandisets/000108/", newest)
    rows = [{"asset_id": ASSET, "path": PATH}]
    archive.json("/api/dandisets/000108/versions/0.240101.0900/assets/", {"results": rows})
    resolve(f"{PAGE}/000108")
    assert any("0.240101.0900" in path for path in archive.paths)


@pytest.mark.parametrize(
    ("paths", "words"),
    [
        ([], "0 assets"),
        (["a/b.nwb", "a/c.json"], "2 assets at 'a', but no Zarr or NIfTI"),
        (["ab/c.nii.gz"], "0 assets at 'a'"),
        ([f"a/{n}.nii.gz" for n in range(9)], "9 assets, 9 of them Zarr or NIfTI ('a/0.nii.gz', "),
    ],
)
def test_a_path_of_no_asset_or_of_several_is_refused(
    archive: Service, paths: list[str], words: str
) -> None:
    rows = [{"asset_id": ASSET, "path": path} for path in paths]
    archive.json("/api/dandisets/000108/versions/draft/assets/", {"results": rows})
    with pytest.raises(StereoCellError) as caught:
        resolve(f"{PAGE}/000108/draft/files?location=a")
    assert words in str(caught.value)


def test_the_full_name_is_enough_among_many(archive: Service) -> None:
    """A path of more assets than one answer lists doesn't determine one of them."""
    rows = [{"asset_id": ASSET, "path": PATH}, {"asset_id": ZARR, "path": "sub-MITU01/a.json"}]
    page = {"next": f"{archive.url}/page/2", "results": rows}
    archive.json("/api/dandisets/000108/versions/draft/assets/", page)
    assert resolve(f"{PAGE}/000108/draft/files?location={PATH}").source.endswith(f"{ZARR}/")
    with pytest.raises(UsageError, match="2 assets or more, 1 of them Zarr or NIfTI"):
        resolve(f"{PAGE}/000108/draft/files?location=sub-MITU01")
    assert "/page/2" not in archive.paths


@pytest.mark.parametrize(
    "address",
    [
        "https://evil.example/zarr/x",
        "http://169.254.169.254/latest/meta-data/",
        f"http://127.0.0.1:9/data/zarr/{ZARR}/",
        "file:///etc/passwd",
        "s3://other/zarr/",
        "DATA/../secret",
        f"DATA/zarr/../../{ZARR}",
        f"DATA/zarr/{ZARR}?x=1",
        "DATA.evil.example/zarr/x",
        7,
        None,
    ],
)
def test_data_elsewhere_are_refused(archive: Service, address: Any) -> None:
    asset = metadata(archive)
    if isinstance(address, str):
        address = address.replace("DATA", f"{archive.url}/data")
    asset["contentUrl"] = [asset["contentUrl"][0], address]
    archive.json(f"/api/assets/{ASSET}/", asset)
    with pytest.raises(SourceError, match="in the archive's public bucket"):
        resolve(f"https://api.dandiarchive.org/api/assets/{ASSET}/")
    assert archive.paths == [f"/api/assets/{ASSET}/"]


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (Answer(b"<html>"), "found a web page"),
        (Answer(b"[1]"), "found no metadata"),
        (Answer(b"{}"), "contentUrl 'none'"),
        (Answer(b"", 404), "not found, expected the UUID of an asset"),
        (Answer(b"", 401), "HTTP 401"),
    ],
)
def test_a_bad_answer_is_refused_in_one_line(archive: Service, answer: Answer, words: str) -> None:
    archive.answers[f"/api/assets/{ASSET}/"] = answer
    with pytest.raises(SourceError, match=words):
        resolve(f"https://api.dandiarchive.org/api/assets/{ASSET}/")


@pytest.mark.parametrize(
    ("path", "kind", "words"),
    [
        ("sub-1/a.nwb", "application/x-nwb", "application/x-nwb"),
        ("sub-1/a.nwb.zarr", "application/x-zarr", "NWB in Zarr"),
        ("sub-1/a.mp4", "video/mp4", "video/mp4"),
    ],
)
def test_other_kinds_are_named(archive: Service, path: str, kind: str, words: str) -> None:
    archive.json(f"/api/assets/{ASSET}/", metadata(archive, path=path, kind=kind))
    with pytest.raises(SourceError, match=words):
        resolve(f"https://api.dandiarchive.org/api/assets/{ASSET}/")


@pytest.mark.parametrize("rows", [{}, {"results": 1}, [], {"results": [{"path": "a/b.zarr"}]}])
def test_a_bad_list_of_assets_is_refused_in_one_line(archive: Service, rows: Any) -> None:
    archive.json("/api/dandisets/000108/versions/draft/assets/", rows)
    with pytest.raises(SourceError, match="the server's answer"):
        resolve(f"{PAGE}/000108/draft/files?location=a")


@pytest.mark.parametrize(
    "address",
    [
        "https://dandiarchive.org/",
        "https://dandiarchive.org/dandiset/12",
        "https://dandiarchive.org/dandiset/000108/..",
        "https://api.dandiarchive.org/api/assets/not-a-uuid/",
        "https://api.dandiarchive.org/api/zarr/",
        f"{PAGE}/search?search=mouse",
    ],
)
def test_an_unknown_form_is_refused_with_the_known_ones(archive: Service, address: str) -> None:
    with pytest.raises(UsageError, match=r"another form of .*, expected https://api\.dandi"):
        resolve(address)
    assert archive.asked == []
