"""Links of viewers of OME-Zarr, and pages of OMERO.web."""

import socket
from typing import Any

import pytest

from stereocell.model.errors import SourceError, UsageError
from stereocell.read.addresses.resolve import resolve

DATA = "https://data.example/a/image.ome.zarr"


@pytest.fixture(autouse=True)
def names(monkeypatch: pytest.MonkeyPatch) -> None:
    """Names of hosts without a network: `data.example` is public, others are not known."""
    known = {"data.example": "93.184.215.14", "inner.example": "10.0.0.7"}

    def getaddrinfo(host: str, port: int, **options: Any) -> list[Any]:
        number = known.get(host, host)
        if not number[:1].isdigit() and ":" not in number:
            raise socket.gaierror("unknown")
        return [(0, 0, 0, "", (number, port))]

    monkeypatch.setattr(socket, "getaddrinfo", getaddrinfo)


@pytest.mark.parametrize(
    "link",
    [
        f"https://hms-dbmi.github.io/vizarr/?source={DATA}",
        f"https://hms-dbmi.github.io/vizarr/v0.3?source={DATA}&channelAxis=0",
        "https://ome.github.io/ome-ngff-validator/?source=https%3A%2F%2Fdata.example%2Fa%2Fimage.ome.zarr",
        f"https://omero.example/zarr/vizarr/index.html?source={DATA}",
        f"https://viewer.example/index.html?source={DATA}#view=1",
        f"https://vizarr.example/#/?source={DATA}",
    ],
)
def test_the_image_in_a_link_is_found(link: str) -> None:
    found = resolve(link)
    assert found.source == DATA
    assert found.notes == (f"the link's image is read from {DATA}",)


def test_a_signature_stays_in_the_address_and_out_of_the_note() -> None:
    found = resolve(
        "https://x.github.io/vizarr/?source=https%3A%2F%2Fdata.example%2Fa.zarr%3Fsig%3Dabc"
    )
    assert found.source == "https://data.example/a.zarr?sig=abc"
    assert "abc" not in str(found.notes)


def test_an_address_in_a_bucket_is_accepted() -> None:
    assert resolve("https://x.github.io/vizarr?source=s3://b/a.zarr").source == "s3://b/a.zarr"


@pytest.mark.parametrize(
    "inner",
    [
        *("http://127.0.0.1:8000/a.zarr", "http://169.254.169.254/a.zarr", "http://[::1]/a.zarr"),
        *("http://[fd00::1]/a.zarr", "https://inner.example/a.zarr", "http://192.168.0.2/a.zarr"),
    ],
)
def test_an_image_in_the_network_is_refused(inner: str) -> None:
    with pytest.raises(SourceError, match=r"private network.*name it yourself"):
        resolve(f"https://hms-dbmi.github.io/vizarr/?source={inner}")


@pytest.mark.parametrize(
    "inner",
    ["file:///etc/passwd", "/etc/passwd", "javascript:1", "a.zarr", "https://a/%1b[31m.zarr"],
)
def test_an_image_without_a_valid_address_is_refused(inner: str) -> None:
    with pytest.raises(UsageError, match="expected an http"):
        resolve(f"https://hms-dbmi.github.io/vizarr/?source={inner}")


def test_a_user_name_in_an_image_s_address_is_not_shown() -> None:
    with pytest.raises(SourceError, match="user name") as caught:
        resolve("https://hms-dbmi.github.io/vizarr/?source=https://me:hunter2@data.example/a.zarr")
    assert "hunter2" not in str(caught.value)


def test_a_link_to_several_images_is_refused() -> None:
    with pytest.raises(UsageError, match="a link to 2 images"):
        resolve(f"https://hms-dbmi.github.io/vizarr/?source={DATA}&source={DATA}2")


def test_a_viewer_without_an_image_is_refused_with_the_known_forms() -> None:
    with pytest.raises(UsageError, match=r"expected https://HOST/\.\.\./vizarr/"):
        resolve("https://hms-dbmi.github.io/vizarr/")


@pytest.mark.parametrize("page", ["/webclient/?show=image-3", "/iviewer/?images=3", "/webgateway/"])
def test_a_page_of_omero_web_is_refused_with_the_known_forms(page: str) -> None:
    with pytest.raises(UsageError, match=r"OMERO\.web.*expected https://HOST"):
        resolve(f"https://omero.example{page}")


@pytest.mark.parametrize(
    "other",
    [
        "https://data.example/vizarr/a.zarr",
        "https://data.example/index.html",
        "https://data.example/a.ome.tif?source=x",
        "s3://bucket/vizarr/",
        "/vizarr/a.tif",
        "a.ome.zarr",
    ],
)
def test_other_sources_are_not_changed(other: str) -> None:
    assert resolve(other).notes == ()
    assert resolve(other).source.endswith(other)
