"""BioImage Archive: pages of images and studies.

The answers follow the requests of the archive's own pages and the tests of its API; none was
recorded.
"""

from typing import Any

import pytest

from stereocell.model.errors import SourceError, UsageError
from stereocell.read.addresses import bioimage_archive
from stereocell.read.addresses.resolve import resolve
from support.recorded_service import Answer, Service

IMAGE, STUDY = "001b8ef2-7a5e-4b94-b91c-d93f5095ee39", "a6ecc705-7de4-406b-80f9-bd76322465e3"
DATASET, OTHER = "11111111-7de4-406b-80f9-bd76322465e3", "22222222-7de4-406b-80f9-bd76322465e3"
PAGE = f"https://www.ebi.ac.uk/bioimage-archive/image/{IMAGE}"


@pytest.fixture
def archive(service: Service, monkeypatch: pytest.MonkeyPatch) -> Service:
    """The archive with study S-BIAD843, which has one image."""
    monkeypatch.setattr(bioimage_archive, "API", f"{service.url}/api/v2")
    study = {"uuid": STUDY, "accession_id": "S-BIAD843"}
    service.json("/api/v2/search/study/accession?accession_id=S-BIAD843&page_size=1", study)
    service.json(f"/api/v2/study/{STUDY}/dataset?page_size=100", [{"uuid": DATASET}])
    service.json(f"/api/v2/dataset/{DATASET}/image?page_size=100", [{"uuid": IMAGE}])
    service.json(f"/api/v2/image/{IMAGE}/image_representation?page_size=100", represented())
    return service


def represented(place: Any = "") -> list[dict[str, Any]]:
    base = "https://uk1s3.embassy.ebi.ac.uk/bia-integrator-data/S-BIAD843"
    place = place or f"{base}/{IMAGE}/{IMAGE}.ome.zarr/0"
    return [
        {"image_format": ".png", "use_type": "THUMBNAIL", "file_uri": [f"{base}/a.png"]},
        {"image_format": ".ome.zarr", "use_type": "INTERACTIVE_DISPLAY", "file_uri": [place]},
    ]


@pytest.mark.parametrize(
    "page",
    [
        PAGE,
        f"{PAGE}/",
        f"https://beta.bioimagearchive.org/bioimage-archive/image/{IMAGE}",
        "https://www.ebi.ac.uk/bioimage-archive/study/S-BIAD843",
        "https://www.ebi.ac.uk/bioimage-archive/galleries/S-BIAD843-ai.html",
        "https://www.ebi.ac.uk/biostudies/BioImages/studies/S-BIAD843",
        "https://www.ebi.ac.uk/biostudies/studies/S-BIAD843?query=wing",
        "https://uk1s3.embassy.ebi.ac.uk/bia-integrator-data/pages/S-BIAD843.html",
    ],
)
def test_each_form_leads_to_the_image(archive: Service, page: str) -> None:
    found = resolve(page)
    assert found.source == represented()[1]["file_uri"][0]
    assert found.notes == (f"BioImage Archive image {IMAGE} is read from {found.source}",)


@pytest.mark.parametrize(
    "data",
    [
        "https://uk1s3.embassy.ebi.ac.uk/bia-integrator-data/S-BIAD843/a/a.ome.zarr",
        "https://uk1s3.embassy.ebi.ac.uk/bia-integrator-data/S-BSST410/IM4/IM4.zarr/0",
        "https://www.ebi.ac.uk/biostudies/files/S-BIAD843/wing.ome.tif",
        "https://www.ebi.ac.uk/biostudies/files/S-BIAD843/wing.n5",
    ],
)
def test_addresses_of_data_are_not_changed(archive: Service, data: str) -> None:
    assert resolve(data).source == data
    assert archive.asked == []


def test_a_study_of_several_images_is_refused_with_the_list(archive: Service) -> None:
    images = [{"uuid": IMAGE}, {"uuid": OTHER}]
    archive.json(f"/api/v2/dataset/{DATASET}/image?page_size=100", images)
    with pytest.raises(UsageError, match="a study of 2 images or more, expected the page of one"):
        resolve("https://www.ebi.ac.uk/bioimage-archive/study/S-BIAD843")


@pytest.mark.parametrize("answer", [Answer(b"", 404), Answer(b"null"), Answer(b"[]")])
def test_an_absent_study_is_refused(archive: Service, answer: Answer) -> None:
    archive.answers["/api/v2/search/study/accession?accession_id=S-BIAD843&page_size=1"] = answer
    with pytest.raises(SourceError, match="S-BIAD843: not found"):
        resolve("https://www.ebi.ac.uk/bioimage-archive/study/S-BIAD843")


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (b"<html>", "found a web page"),
        (b"{}", "found no list"),
        (b"[]", "found no OME-Zarr"),
        (b"[1, null]", "found no OME-Zarr"),
        (b'[{"image_format": ".ome.zarr", "file_uri": "https://a"}]', "found no OME-Zarr"),
        (b'[{"image_format": ".ome.zarr", "file_uri": [null]}]', "found no OME-Zarr"),
    ],
)
def test_a_bad_answer_is_refused_in_one_line(archive: Service, answer: bytes, words: str) -> None:
    archive.put(f"/api/v2/image/{IMAGE}/image_representation?page_size=100", answer)
    with pytest.raises(SourceError, match=words):
        resolve(PAGE)


@pytest.mark.parametrize(
    "place",
    [
        "http://127.0.0.1:80/a.zarr",
        "http://169.254.169.254/a.zarr",
        "https://evil.example/a.ome.zarr",
        "https://uk1s3.embassy.ebi.ac.uk.evil.example/a.zarr",
        "https://uk1s3.embassy.ebi.ac.uk/../../a.zarr",
        "https://uk1s3.embassy.ebi.ac.uk/%2e%2e/a.zarr",
        "https://uk1s3.embassy.ebi.ac.uk/a.zip",
        "https://uk1s3.embassy.ebi.ac.uk/\x1b[31m/a.zarr",
        "https://uk1s3.embassy.ebi.ac.uk/a\n/b.zarr",
        "file:///etc/a.zarr",
    ],
)
def test_data_elsewhere_are_refused(archive: Service, place: str) -> None:
    archive.json(f"/api/v2/image/{IMAGE}/image_representation?page_size=100", represented(place))
    with pytest.raises(SourceError, match="expected an OME-Zarr below https://uk1s3"):
        resolve(PAGE)


@pytest.mark.parametrize("uuid", ["../../x", "", None, 4])
def test_a_bad_uuid_is_refused(archive: Service, uuid: Any) -> None:
    archive.json(f"/api/v2/study/{STUDY}/dataset?page_size=100", [{"uuid": uuid}])
    with pytest.raises(SourceError, match="expected a UUID"):
        resolve("https://www.ebi.ac.uk/bioimage-archive/study/S-BIAD843")
    assert not any(".." in path for path in archive.paths)


@pytest.mark.parametrize(
    "page",
    [
        "https://www.ebi.ac.uk/bioimage-archive/",
        "https://www.ebi.ac.uk/bioimage-archive/image/7",
        "https://www.ebi.ac.uk/bioimage-archive/search?query=S-BIAD1",
        "https://uk1s3.embassy.ebi.ac.uk/bia-integrator-data/pages/",
    ],
)
def test_an_unknown_form_is_refused_with_the_known_ones(archive: Service, page: str) -> None:
    with pytest.raises(UsageError, match=r"another form of .*, expected https://www"):
        resolve(page)
    assert archive.asked == []
