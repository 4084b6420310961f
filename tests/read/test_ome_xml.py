"""OME-XML in the forms that other programs write."""

import pytest

from stereocell.model.errors import SourceError
from stereocell.read.ome_xml import images_of, parse

NS = "http://www.openmicroscopy.org/Schemas/OME/2016-06"


def images(inside: str, namespace: str = NS):  # type: ignore[no-untyped-def]
    return images_of(parse(f'<OME xmlns="{namespace}">{inside}</OME>', "x.tif"), "x.tif")


def test_spacing_names_and_colours_are_read() -> None:
    first, second = images(
        # an identifier that the schema forbids, written by Micro-Manager
        '<Instrument ID="Microscope"/>'
        '<Image ID="0"><Pixels PhysicalSizeX="200" PhysicalSizeXUnit="nm" PhysicalSizeY="0.2" '
        'PhysicalSizeZ="0.001" PhysicalSizeZUnit="mm">'
        '<Channel Name=" DAPI " Color="65535"/><Channel Color="-16776961"/><Channel/>'
        "</Pixels></Image><Image/>"
    )
    assert first.spacing_um == pytest.approx((1.0, 0.2, 0.2))
    assert first.names == ("DAPI", None, None)
    # R, G, B, A in a signed number: 0x0000ffff is blue, 0xff0000ff red
    assert first.colors == ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), None)
    assert (second.spacing_um, second.names, second.colors) == ((None, None, None), (), ())


@pytest.mark.parametrize("version", ["2016-06", "2013-06", "2008-09"])
def test_the_namespace_of_every_version_is_accepted(version: str) -> None:
    found = images('<Image><Pixels><Channel Name="A"/></Pixels></Image>', NS[:-7] + version)
    assert found[0].names == ("A",)


@pytest.mark.parametrize(
    ("inside", "expected"),
    [
        ('<Image><Pixels PhysicalSizeZ="deep"/></Image>', "PhysicalSizeZ: found 'deep'"),
        ('<Image><Pixels><Channel Color="red"/></Pixels></Image>', "Channel Color: found 'red'"),
    ],
)
def test_invalid_metadata_are_refused_with_their_field(inside: str, expected: str) -> None:
    with pytest.raises(SourceError, match=expected):
        images(inside)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "OME-XML: found none"),
        ("ImageJ=1.53\nimages=5", "OME-XML: found none"),
        ("<OME>", "OME-XML: no element found"),
        ("<html></html>", "found <html>, expected <OME>"),
        ('<!DOCTYPE x [<!ENTITY a "b">]><OME/>', "found a DOCTYPE"),
    ],
)
def test_text_that_is_not_ome_xml_is_refused(text: str, expected: str) -> None:
    with pytest.raises(SourceError, match=expected):
        parse(text, "x.tif")
