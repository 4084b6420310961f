"""Write bodies as 3MF: one object with a part for each body, with unit, names and colours.

Slicers put each object on the bed separately, so the bodies of a specimen have to be one object.
There are two ways to state its parts:

    ranges      One mesh, and PrusaSlicer's list of the ranges of its triangles that are parts.
                Bambu Studio and OrcaSlicer read that list, too, if the metadata "Application"
                contains the name of PrusaSlicer. Other programs see one mesh of coloured triangles.
    components  A mesh for each body, joined by the core specification's components, and Bambu
                Studio's list of parts. PrusaSlicer treats components as separate objects.

trimesh writes neither colours nor units nor these lists, and gives each object a random UUID. Here
the same bodies have to give the same bytes, so dates are fixed, too.

References
----------
3MF Consortium. 3D Manufacturing Format, Core Specification 1.3.
PrusaSlicer 2.9, src/libslic3r/Format/3mf.cpp: `_generate_volumes`, `_create_object_instance`.
Bambu Studio, src/libslic3r/Format/3mf.cpp: `check_3mf_from_prusa`; bbs_3mf.cpp:
`_generate_volumes_new`.
"""

import re
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

import numpy as np
from numpy.typing import NDArray

from stereocell.formats.body import Body
from stereocell.model.version import GENERATOR

UNITS = {"um": "micron", "mm": "millimeter", "m": "meter"}
_FILAMENTS = 16  # largest number of a filament; further bodies get the first one
_CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_PACKAGE = "http://schemas.openxmlformats.org/package/2006"
_HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
_TYPES = (
    f'{_HEAD}<Types xmlns="{_PACKAGE}/content-types">'
    '<Default Extension="rels" '
    'ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" '
    'ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
    '<Default Extension="config" ContentType="application/xml"/></Types>'
)
_RELATIONS = (
    f'{_HEAD}<Relationships xmlns="{_PACKAGE}/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="rel0" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)
_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_ROWS = 10_000  # number of rows that are turned into text at a time
_MATERIALS, _WHOLE, _FIRST = 1, 2, 3  # IDs in the model: colours, the object, its first component


def write_3mf(
    path: Path, bodies: Sequence[Body], *, title: str, unit: str, components: bool = False
) -> None:
    """Write the bodies as parts of one object. `unit`: unit of the positions, a key of UNITS.

    Where parts overlap, slicers print the later one.
    """
    if components:
        objects, maker = _components(bodies, title), ""
        settings = "model_settings", _bambu_parts(bodies, title)
    else:
        objects, maker = _one_mesh(bodies, title), " (parts as in PrusaSlicer)"
        settings = "Slic3r_PE_model", _prusa_parts(bodies, title)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive:
        for name, text in (
            ("[Content_Types].xml", [_TYPES]),
            ("_rels/.rels", [_RELATIONS]),
            ("3D/3dmodel.model", _model(bodies, title, UNITS[unit], objects, maker)),
            (f"Metadata/{settings[0]}.config", settings[1]),
        ):
            with archive.open(_entry(name), "w", force_zip64=True) as file:
                for part in text:
                    file.write(part.encode())


def _entry(name: str) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
    info.compress_type = zipfile.ZIP_DEFLATED
    return info


def _model(
    bodies: Sequence[Body], title: str, unit: str, objects: Iterator[str], maker: str
) -> Iterator[str]:
    yield f'{_HEAD}<model unit="{unit}" xml:lang="en-US" xmlns="{_CORE}">\n'
    yield f'<metadata name="Title">{escape(_text(title))}</metadata>\n'
    yield f'<metadata name="Application">{GENERATOR}{maker}</metadata>\n'
    yield f'<resources>\n<basematerials id="{_MATERIALS}">\n'
    for body in bodies:
        color = "".join(f"{part:02X}" for part in body.srgb)
        yield f'<base name={_quoted(body.name)} displaycolor="#{color}FF"/>\n'
    yield "</basematerials>\n"
    yield from objects
    yield f'</resources>\n<build>\n<item objectid="{_WHOLE}"/>\n</build>\n</model>\n'


def _one_mesh(bodies: Sequence[Body], title: str) -> Iterator[str]:
    """Yield one mesh of all bodies. Vertices of a body are contiguous, as PrusaSlicer requires."""
    yield f'<object id="{_WHOLE}" name={_quoted(title)} type="model" pid="{_MATERIALS}" pindex="0">'
    yield "<mesh><vertices>\n"
    for body in bodies:
        yield from _vertices(body)
    yield "</vertices><triangles>\n"
    first = 0
    for number, body in enumerate(bodies):
        form = f'<triangle v1="%d" v2="%d" v3="%d" pid="{_MATERIALS}" p1="{number}"/>\n'
        yield from _rows(form, body.triangles + np.uint32(first))
        first += len(body.positions)
    yield "</triangles></mesh></object>\n"


def _components(bodies: Sequence[Body], title: str) -> Iterator[str]:
    """Yield a mesh for each body, and the object of which they are components."""
    for number, body in enumerate(bodies):
        yield f'<object id="{_FIRST + number}" name={_quoted(body.name)} type="model" '
        yield f'pid="{_MATERIALS}" pindex="{number}"><mesh><vertices>\n'
        yield from _vertices(body)
        yield "</vertices><triangles>\n"
        yield from _rows('<triangle v1="%d" v2="%d" v3="%d"/>\n', body.triangles)
        yield "</triangles></mesh></object>\n"
    yield f'<object id="{_WHOLE}" name={_quoted(title)} type="model"><components>\n'
    for number in range(len(bodies)):
        yield f'<component objectid="{_FIRST + number}"/>\n'
    yield "</components></object>\n"


def _prusa_parts(bodies: Sequence[Body], title: str) -> Iterator[str]:
    yield f'{_HEAD}<config>\n<object id="{_WHOLE}" instances_count="1">\n'
    yield f'<metadata type="object" key="name" value={_quoted(title)}/>\n'
    first = 0
    for body in bodies:
        last = first + len(body.triangles) - 1
        yield f'<volume firstid="{first}" lastid="{last}">\n'
        for key, value in _settings(body):
            yield f'<metadata type="volume" key="{key}" value={_quoted(value)}/>\n'
        yield '<metadata type="volume" key="volume_type" value="ModelPart"/>\n</volume>\n'
        first = last + 1
    yield "</object>\n</config>\n"


def _bambu_parts(bodies: Sequence[Body], title: str) -> Iterator[str]:
    yield f'{_HEAD}<config>\n<object id="{_WHOLE}">\n'
    yield f'<metadata key="name" value={_quoted(title)}/>\n'
    for number, body in enumerate(bodies):
        yield f'<part id="{_FIRST + number}" subtype="normal_part">\n'
        for key, value in _settings(body):
            yield f'<metadata key="{key}" value={_quoted(value)}/>\n'
        yield "</part>\n"
    yield "</object>\n</config>\n"


def _settings(body: Body) -> Iterator[tuple[str, str]]:
    yield "name", body.name
    yield "extruder", str(body.filament if body.filament <= _FILAMENTS else 1)


def _vertices(body: Body) -> Iterator[str]:
    return _rows('<vertex x="%.9g" y="%.9g" z="%.9g"/>\n', body.positions)


def _rows(form: str, rows: NDArray[np.float32] | NDArray[np.uint32]) -> Iterator[str]:
    for start in range(0, len(rows), _ROWS):
        part = rows[start : start + _ROWS]
        yield (form * len(part)) % tuple(part.ravel().tolist())


def _text(text: str) -> str:
    """Return the text with U+FFFD in place of characters that XML does not allow."""
    return _NOT_XML.sub("\N{REPLACEMENT CHARACTER}", text)


def _quoted(text: str) -> str:
    return quoteattr(_text(text))
