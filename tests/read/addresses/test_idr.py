"""Image Data Resource: the pages of images, and the OME-Zarr behind them.

The answers follow the documentation of OMERO's JSON API and the requests of OMERO.iviewer
(paths_to_object); the addresses are from the Resource's list of samples. None was recorded.
"""

from typing import Any

import pytest

from stereocell.model.errors import SourceError, UsageError
from stereocell.read.addresses import idr
from stereocell.read.addresses.resolve import resolve
from support.recorded_service import Answer, Service

PAGE = "https://idr.openmicroscopy.org"
ID = "6001240"


@pytest.fixture
def resource(service: Service, monkeypatch: pytest.MonkeyPatch) -> Service:
    """The Resource with one image of study idr0062, whose data are not stored yet."""
    monkeypatch.setattr(idr, "PAGES", service.url)
    monkeypatch.setattr(idr, "DATA", (f"{service.url}/idr/zarr", f"{service.url}/second"))
    path = [
        {"type": "experimenter", "id": 2},
        {"type": "project", "id": 801, "childCount": 1},
        {"type": "dataset", "id": 7754},
        {"type": "image", "id": int(ID)},
    ]
    service.json(f"/webclient/api/paths_to_object/?image={ID}", {"paths": [path]})
    project = {"@id": 801, "Name": "idr0062-blin-nuclearsegmentation/experimentA"}
    service.json("/api/v0/m/projects/801/", {"data": project})
    return service


@pytest.mark.parametrize(
    "page",
    [
        f"{PAGE}/webclient/?show=image-{ID}",
        f"http://idr.openmicroscopy.org/webclient/?show=image-{ID}",
        f"{PAGE}/webclient/img_detail/{ID}/",
        f"{PAGE}/webclient/img_detail/{ID}/?dataset=7754",
        f"{PAGE}/webgateway/img_detail/{ID}",
        f"{PAGE}/iviewer/?images={ID}",
        f"{PAGE}/webclient/iviewer/?images={ID}&dataset=7754",
    ],
)
def test_each_form_of_a_page_leads_to_the_image(resource: Service, page: str) -> None:
    resource.put(f"/idr/zarr/v0.4/idr0062A/{ID}.zarr/.zattrs", b"{}")
    found = resolve(page)
    place = f"{resource.url}/idr/zarr/v0.4/idr0062A/{ID}.zarr"
    assert found.source == place
    assert found.notes == (f"IDR image {ID} is read from {place}",)


@pytest.mark.parametrize(
    "file",
    [
        f"v0.5/idr0062A/{ID}.zarr/zarr.json",
        f"v0.5/idr0062/{ID}.zarr/zarr.json",
        f"v0.4/idr0062A/{ID}.zarr/.zattrs",
        f"v0.3/idr0062A/{ID}.zarr/.zattrs",
        f"v0.3/{ID}.zarr/.zattrs",
        f"v0.2/{ID}.zarr/.zattrs",
        f"v0.1/{ID}.zarr/.zattrs",
    ],
)
def test_the_newest_existing_version_is_read(resource: Service, file: str) -> None:
    resource.put(f"/idr/zarr/{file}")
    resource.put(f"/idr/zarr/v0.1/{ID}.zarr/.zattrs")
    assert resolve(f"{PAGE}/iviewer/?images={ID}").source == (
        f"{resource.url}/idr/zarr/{file.rpartition('/')[0]}"
    )


def test_an_image_without_ome_zarr_is_refused(resource: Service) -> None:
    with pytest.raises(SourceError, match=r"no OME-Zarr at .*v0\.5 to v0\.1.*ome-ngff-samples"):
        resolve(f"{PAGE}/iviewer/?images={ID}")
    requested = [path for path in resource.paths if path.startswith("/idr/zarr/")]
    assert len(requested) == 3 * 3 + 2
    assert not any(path.startswith("/second") for path in resource.paths)


def test_the_second_name_of_the_bucket_is_used_if_the_first_is_down(resource: Service) -> None:
    resource.answers[f"/idr/zarr/v0.5/idr0062A/{ID}.zarr/zarr.json"] = Answer(b"", 503)
    resource.put(f"/second/v0.4/idr0062A/{ID}.zarr/.zattrs")
    found = resolve(f"{PAGE}/iviewer/?images={ID}")
    assert found.source == f"{resource.url}/second/v0.4/idr0062A/{ID}.zarr"
    resource.answers[f"/second/v0.5/idr0062A/{ID}.zarr/zarr.json"] = Answer(b"", 503)
    with pytest.raises(SourceError, match="HTTP 503"):
        resolve(f"{PAGE}/iviewer/?images={ID}&again=1")


def test_a_bucket_may_refuse_absent_files(resource: Service) -> None:
    resource.answers[f"/idr/zarr/v0.5/idr0062A/{ID}.zarr/zarr.json"] = Answer(b"", 403)
    resource.put(f"/idr/zarr/v0.1/{ID}.zarr/.zattrs")
    assert resolve(f"{PAGE}/iviewer/?images={ID}").source.endswith(f"/v0.1/{ID}.zarr")


def test_an_absent_image_is_refused(resource: Service) -> None:
    with pytest.raises(SourceError, match="IDR image 999: not found"):
        resolve(f"{PAGE}/iviewer/?images=999")


@pytest.mark.parametrize(
    ("answer", "project"),
    [
        ({}, {}),
        ([], {}),
        ({"paths": "x"}, {}),
        ({"paths": [None, [None, {"type": "project"}]]}, {}),
        ({"paths": [[{"type": "project", "id": "801/../../x"}]]}, {}),
        ({"paths": [[{"type": "project", "id": 801}]]}, []),
        ({"paths": [[{"type": "project", "id": 801}]]}, {"data": {"Name": "../../etc/idr0062"}}),
        ({"paths": [[{"type": "project", "id": 801}]]}, {"data": {"Name": None}}),
    ],
)
def test_after_odd_answers_the_addresses_without_a_study_are_tried(
    resource: Service, answer: Any, project: Any
) -> None:
    resource.json(f"/webclient/api/paths_to_object/?image={ID}", answer)
    resource.json("/api/v0/m/projects/801/", project)
    resource.put(f"/idr/zarr/v0.2/{ID}.zarr/.zattrs")
    assert resolve(f"{PAGE}/iviewer/?images={ID}").source.endswith(f"/v0.2/{ID}.zarr")
    assert not any(".." in path for path in resource.paths)


def test_a_page_in_place_of_json_is_refused_in_one_line(resource: Service) -> None:
    resource.put(f"/webclient/api/paths_to_object/?image={ID}", b"<html>maintenance</html>")
    with pytest.raises(SourceError, match="found a web page"):
        resolve(f"{PAGE}/iviewer/?images={ID}")


@pytest.mark.parametrize(
    "page",
    [
        PAGE,
        f"{PAGE}/webclient/?show=project-801",
        f"{PAGE}/webclient/?show=well-5",
        f"{PAGE}/webclient/?show=image-1|image-2",
        f"{PAGE}/iviewer/?images=1,2",
        f"{PAGE}/iviewer/?images=1&images=2",
        f"{PAGE}/iviewer/?dataset=7754",
        f"{PAGE}/iviewer/?images=-1",
        f"{PAGE}/iviewer/?images=1%2F..%2F2",
        f"{PAGE}/search/?query=nuclei",
    ],
)
def test_an_unknown_form_is_refused_with_the_known_ones(resource: Service, page: str) -> None:
    with pytest.raises(UsageError, match=r"another form of .*, expected https://idr"):
        resolve(page)
    assert resource.asked == []
