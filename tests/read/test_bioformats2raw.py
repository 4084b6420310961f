"""The OME-XML that bioformats2raw keeps beside its images: positions of planes and further axes."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr

from stereocell import read
from stereocell.cli.__main__ import main
from stereocell.model.errors import UsageError
from stereocell.read import list_series
from support.phantoms import f_phantom, write_ome_zarr
from support.reading import whole

BODY = f_phantom()
OTHER = BODY[:, ::-1] + 100
MODULO = (
    '<XMLAnnotation ID="Annotation:{}" Namespace="openmicroscopy.org/omero/dimension/modulo">'
    '<Value><Modulo namespace="http://www.openmicroscopy.org/Schemas/Additions/2011-09">'
    '<ModuloAlongZ Type="angle" Start="0" End="{}" Step="90"/></Modulo></Value></XMLAnnotation>'
)


def container(folder: Path, voxels: list[Any], pixels: list[str], annotations: str = "") -> Path:
    """Write a container of images, and OME-XML with the elements in each image's Pixels.

    An image refers to the annotation with its own number.
    """
    root = zarr.open_group(folder, mode="w", zarr_format=2)
    root.attrs["bioformats2raw.layout"] = 3
    images = ""
    for number, (array, inner) in enumerate(zip(voxels, pixels, strict=True)):
        write_ome_zarr(folder / str(number), [array], version="0.4")
        z, y, x = array.shape
        images += (
            f'<Image ID="Image:{number}"><Pixels ID="Pixels:{number}" DimensionOrder="XYZCT" '
            f'Type="uint16" SizeX="{x}" SizeY="{y}" SizeZ="{z}" SizeC="1" SizeT="1" '
            f'PhysicalSizeX="0.2" PhysicalSizeY="0.2" PhysicalSizeZ="0.5"><MetadataOnly/>{inner}'
            f'</Pixels><AnnotationRef ID="Annotation:{number}"/></Image>'
        )
    (folder / "OME").mkdir()
    (folder / "OME" / "METADATA.ome.xml").write_text(
        f'<OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06">{images}'
        f"<StructuredAnnotations>{annotations}</StructuredAnnotations></OME>",
        "utf-8",
    )
    return folder


def places(step: float) -> str:
    return "".join(
        f'<Plane TheZ="{z}" TheC="0" TheT="0" PositionZ="{z * step:.3f}" PositionZUnit="µm"/>'
        for z in range(len(BODY))
    )


def test_positions_of_planes_give_the_spacing_where_the_scale_differs(tmp_path: Path) -> None:
    path = container(tmp_path / "c.zarr", [BODY], [places(0.8)])
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx((0.8, 0.2, 0.2))
    assert "PositionZ of the planes states 0.8 um, scale states 0.5 um" in dataset.notes[0]
    assert read.open(container(tmp_path / "same.zarr", [BODY], [places(0.5)])).notes == ()


@pytest.mark.slow
def test_angles_along_z_are_separate_images(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stored = np.concatenate([BODY, OTHER])
    path = container(tmp_path / "c.zarr", [stored], [""], MODULO.format(0, 90))
    assert [line.split(",")[0].split()[-1] for line in list_series(path)] == ["0", "90"]
    for source in (path, path / "0"):
        first, second = read.open(source), read.open(source, series=2)
        np.testing.assert_array_equal(whole(first), BODY)
        np.testing.assert_array_equal(whole(second), OTHER)
        assert any("ModuloAlongZ: 2 angles" in note for note in first.notes)
    with pytest.raises(UsageError, match="--series: found 3, expected 1 to 2"):
        read.open(path, series=3)
    next(file for file in (path / "0" / "0").rglob("0") if file.is_file()).unlink()
    assert main(["plan", str(path), "-o", str(tmp_path / "o"), "--as", "intensity"]) == 1
    assert "level 0: found none of 1 chunks" in capsys.readouterr().err


def test_an_annotation_of_another_image_is_not_used(tmp_path: Path) -> None:
    annotations = MODULO.format(0, 90) + MODULO.format(1, 270)
    stored = np.concatenate([BODY, OTHER])
    path = container(tmp_path / "c.zarr", [stored, stored], ["", ""], annotations)
    assert len(list_series(path / "0")) == 2
    assert len(list_series(path / "1")) == 4
