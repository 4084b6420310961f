"""Write bodies as 3MF: with a unit, names and colours, which STL lacks.

A 3MF is a zip with one XML of the bodies. Dates are fixed, so that the same bodies give the same
bytes.

References: 3MF Consortium, 3D Manufacturing Format, Core Specification 1.3.
"""

import re
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

import numpy as np
from numpy.typing import NDArray

from stereocell.formats.body import Body
from stereocell.model.version import GENERATOR

UNITS = {"um": "micron", "mm": "millimeter", "m": "meter"}
_CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_PACKAGE = "http://schemas.openxmlformats.org/package/2006"
_HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
_TYPES = (
    f'{_HEAD}<Types xmlns="{_PACKAGE}/content-types">'
    '<Default Extension="rels" '
    'ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" '
    'ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>'
)
_RELATIONS = (
    f'{_HEAD}<Relationships xmlns="{_PACKAGE}/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="rel0" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)
_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_ROWS = 10_000  # rows of numbers that are turned into text at a time


def write_3mf(path: Path, bodies: Iterable[Body], *, title: str, unit: str) -> None:
    """Write the bodies; `unit`: of their numbers, one of UNITS."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive:
        for name, text in (("[Content_Types].xml", _TYPES), ("_rels/.rels", _RELATIONS)):
            archive.writestr(_entry(name), text)
        with archive.open(_entry("3D/3dmodel.model"), "w", force_zip64=True) as file:
            for part in _model(list(bodies), title, UNITS[unit]):
                file.write(part.encode())


def _entry(name: str) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
    info.compress_type = zipfile.ZIP_DEFLATED
    return info


def _attribute(text: str) -> str:
    """Return a quoted attribute; characters that XML can't have become U+FFFD."""
    return quoteattr(_NOT_XML.sub("\N{REPLACEMENT CHARACTER}", text))


def _model(bodies: list[Body], title: str, unit: str) -> Iterator[str]:
    yield f'{_HEAD}<model unit="{unit}" xml:lang="en-US" xmlns="{_CORE}">\n'
    yield f'<metadata name="Title">{_escaped(title)}</metadata>\n'
    yield f'<metadata name="Application">{GENERATOR}</metadata>\n<resources>\n'
    yield '<basematerials id="1">\n'
    for body in bodies:
        color = "".join(f"{part:02X}" for part in body.srgb)
        yield f'<base name={_attribute(body.name)} displaycolor="#{color}FF"/>\n'
    yield "</basematerials>\n"
    for number, body in enumerate(bodies):
        yield f'<object id="{number + 2}" name={_attribute(body.name)} type="model" pid="1" '
        yield f'pindex="{number}"><mesh><vertices>\n'
        yield from _rows('<vertex x="%.9g" y="%.9g" z="%.9g"/>\n', body.positions)
        yield "</vertices><triangles>\n"
        yield from _rows('<triangle v1="%d" v2="%d" v3="%d"/>\n', body.triangles)
        yield "</triangles></mesh></object>\n"
    yield "</resources>\n<build>\n"
    for number in range(len(bodies)):
        yield f'<item objectid="{number + 2}"/>\n'
    yield "</build>\n</model>\n"


def _rows(form: str, rows: NDArray[np.float32] | NDArray[np.uint32]) -> Iterator[str]:
    for start in range(0, len(rows), _ROWS):
        part = rows[start : start + _ROWS]
        yield (form * len(part)) % tuple(part.ravel().tolist())


def _escaped(text: str) -> str:
    return escape(_NOT_XML.sub("\N{REPLACEMENT CHARACTER}", text))
