"""Imaris, CZI, LIF and N5 files of known voxels, written by h5py, Zeiss's library and tensorstore.

No library writes LIF, so that file is made here byte by byte.
"""

import json
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import tensorstore
from numpy.typing import NDArray
from pylibCZIrw import czi

from support.phantoms import f_phantom

SIZE_UM = (0.5, 0.2, 0.25)  # voxel spacing (z, y, x)
BLOCK = (16, 12, 8)  # voxels of an N5 block (x, y, z)


def characters(text: str) -> NDArray[Any]:
    """Return a text as Imaris writes it: an array of single characters."""
    return np.frombuffer(text.encode(), "S1")


def write_ims(path: Path, czyx: NDArray[Any], unit: str = "um", pad: int = 5) -> Path:
    """Write an Imaris file of two resolution levels and two time points.

    pad  number of voxels of 0 that are added at the end of each axis of every dataset
    """
    with h5py.File(path, "w") as file:
        info = file.create_group("DataSetInfo/Image")
        info.attrs["Unit"] = characters(unit)
        for axis, (size, spacing) in enumerate(
            zip(czyx.shape[:0:-1], reversed(SIZE_UM), strict=True)
        ):
            info.attrs["XYZ"[axis]] = characters(str(size))
            info.attrs[f"ExtMin{axis}"] = characters("-3.5")
            info.attrs[f"ExtMax{axis}"] = characters(f"{size * spacing - 3.5:.6f}")
        for c, (name, color) in enumerate((("DAPI", "0 0 1"), ("CD31", "1 0.5 0"))):
            group = file.create_group(f"DataSetInfo/Channel {c}")
            group.attrs["Name"] = characters(name)
            group.attrs["Color"] = characters(color)
        for level, time in np.ndindex(2, 2):
            for c, voxels in enumerate(czyx):
                part = voxels[:, :: 2**level, :: 2**level] + time
                group = file.create_group(
                    f"DataSet/ResolutionLevel {level}/TimePoint {time}/Channel {c}"
                )
                for name, size in zip("ZYX", part.shape, strict=True):
                    group.attrs[f"ImageSize{name}"] = characters(str(size))
                group["Data"] = np.pad(part, [(0, pad)] * 3)
    return path


def write_czi(path: Path, scenes: dict[int | None, NDArray[Any]], **about: Any) -> Path:
    """Write (t, c, z, y, x) of each scene as two tiles that meet in its middle."""
    with czi.create_czi(str(path)) as file:
        for scene, tczyx in scenes.items():
            top = 1000 * (scene or 0)
            middle = tczyx.shape[-1] // 2
            for t, c, z in np.ndindex(tczyx.shape[:3]):
                for part in (slice(0, middle), slice(middle, None)):
                    file.write(
                        data=np.ascontiguousarray(tczyx[t, c, z][:, part, None]),
                        plane={"T": t, "C": c, "Z": z},
                        location=(int(part.start), top),
                        scene=scene or 0,
                    )
        file.write_metadata(
            document_name="Jane Doe",
            channel_names={0: "DAPI", 1: "CD31"},
            scale_x=SIZE_UM[2] * 1e-6,
            scale_y=SIZE_UM[1] * 1e-6,
            scale_z=SIZE_UM[0] * 1e-6,
            **about,
        )
    return path


def write_lif(
    path: Path,
    images: dict[str, tuple[str, NDArray[Any]]],
    spacing: Any = 1.0,
    *,
    unit: str = "m",
    recorded: Mapping[str, float] | None = None,
) -> Path:
    """Write images, each with its axes, slowest first (`TCZYX` or a part in any order).

    unit      stated unit of the lengths; their numbers are always those in metres
    recorded  values of the scanner's records, by their identifiers
    """
    records = "".join(
        f'<ScannerSettingRecord Identifier="{name}" Unit="m" Variant="{value:.9g}"/>'
        for name, value in (recorded or {}).items()
    )
    order = "XYZT"
    sizes_um = dict(zip("ZYX", SIZE_UM, strict=True)) | {"T": 1e6}
    elements, blocks = "", b""
    for number, (name, (axes, voxels)) in enumerate(images.items()):
        strides = dict(zip(axes, voxels.strides, strict=True))
        counts = dict(zip(axes, voxels.shape, strict=True))
        channels = "".join(
            f'<ChannelDescription DataType="0" ChannelTag="0" Resolution="{8 * voxels.itemsize}" '
            'NameOfMeasuredQuantity="" Unit="" Min="0" Max="65535" IsLUTInverted="0" '
            f'LUTName="{lut}" BytesInc="{strides.get("C", 0) * c}" BitInc="0"><ChannelProperty>'
            f"<Key>DyeName</Key><Value>{dye}</Value></ChannelProperty></ChannelDescription>"
            for c, (lut, dye) in enumerate((("Blue", "DAPI"), ("Green", ""))[: counts.get("C", 1)])
        )
        dimensions = "".join(
            f'<DimensionDescription DimID="{order.index(axis) + 1}" '
            f'NumberOfElements="{counts[axis]}" Origin="0" '
            f'Length="{(counts[axis] - 1) * sizes_um[axis] * 1e-6 * spacing:.9g}" '
            f'Unit="{"s" if axis == "T" else unit}" BytesInc="{strides[axis]}" BitInc="0"/>'
            for axis in reversed(axes)
            if axis in order
        )
        elements += (
            f'<Element Name="{name}" UniqueID="u{number}"><Data><Image TextDescription="">'
            f"<ImageDescription><Channels>{channels}</Channels><Dimensions>{dimensions}"
            f'</Dimensions></ImageDescription><Attachment Name="HardwareSetting">{records}'
            "</Attachment></Image></Data>"
            f'<Memory Size="{voxels.nbytes}" MemoryBlockID="Mem{number}"/></Element>'
        )
        block = f"Mem{number}"
        text = block.encode("utf-16-le")
        inner = struct.pack("<BQBI", 0x2A, voxels.nbytes, 0x2A, len(block)) + text
        blocks += struct.pack("<II", 0x70, len(inner)) + inner + voxels.tobytes()
    xml = (
        '<LMSDataContainerHeader Version="2"><Element Name="a"><Data><Experiment/></Data>'
        f'<Memory Size="0" MemoryBlockID="None"/><Children>{elements}</Children></Element>'
        "</LMSDataContainerHeader>"
    )
    text = xml.encode("utf-16-le")
    head = struct.pack("<BI", 0x2A, len(xml)) + text
    path.write_bytes(struct.pack("<II", 0x70, len(head)) + head + blocks)
    return path


def write_n5(
    path: Path, zyx: NDArray[Any] | None = None, packing: Any = None, **attributes: Any
) -> Path:
    voxels = f_phantom() if zyx is None else zyx
    spec = {
        "driver": "n5",
        "kvstore": f"file://{path}/",
        "metadata": {
            "dataType": voxels.dtype.name,
            "dimensions": voxels.shape[::-1],
            "blockSize": BLOCK[: voxels.ndim] + (1,) * (voxels.ndim - 3),
            "compression": packing or {"type": "gzip"},
        },
    }
    stored = tensorstore.open(spec, create=True).result()
    stored.write(voxels.transpose()).result()
    about = path / "attributes.json"
    about.write_text(json.dumps(json.loads(about.read_text("utf-8")) | attributes))
    return path


def write_bdv_xml(folder: Path, container: str, unit: str) -> None:
    """Write BigDataViewer's XML of two setups. With the unit nm, their voxel size is SIZE_UM."""
    setups = "".join(
        f"<ViewSetup><id>{i}</id><name>{name}</name><voxelSize><unit>{unit}</unit>"
        "<size>250 200 500</size></voxelSize></ViewSetup>"
        for i, name in enumerate(("DAPI", "CD31"))
    )
    (folder / "b.xml").write_text(
        '<?xml version="1.0" encoding="UTF-8"?><SpimData version="0.2"><SequenceDescription>'
        f'<ImageLoader format="bdv"><file type="relative">{container}</file></ImageLoader>'
        f"<ViewSetups>{setups}</ViewSetups></SequenceDescription></SpimData>"
    )


def five(body: NDArray[Any]) -> NDArray[Any]:
    """Return (t, c, z, y, x): 2 time points and 2 channels of a body, each with other values."""
    return np.stack([np.stack([body + 10 * t + c for c in (0, 1)]) for t in (0, 1)])
