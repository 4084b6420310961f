"""Read OME-XML: the images of a file, their voxel spacing, and their channels' names and colours.

Python's own parser reads only the parts that a build needs, so a file opens even if its
instruments or annotations break the schema.

References: https://docs.openmicroscopy.org/ome-model/latest/ome-xml/
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from stereocell.model.emission_color import color_of_channel, color_of_light
from stereocell.model.errors import SourceError
from stereocell.read.image import Color
from stereocell.read.repeats import record_xml
from stereocell.read.spacing import PartialTriple, um_per

_HEAD = 4096  # characters at the start of a description that are searched for signs of OME-XML
_DEFAULT_COLOR = -1  # opaque white
_DEFAULT_UNIT = "\u00b5m"  # unit of PhysicalSizeX, Y and Z where the file states none


@dataclass(frozen=True, slots=True)
class OmeImage:
    """One image.

    spacing_um  (z, y, x), um; None for each axis that is not stated with a unit of length
    names       one for each channel; None: not stated
    colors      one for each channel, linear RGB, 0..1; None: not stated
    """

    spacing_um: PartialTriple
    names: tuple[str | None, ...]
    colors: tuple[Color | None, ...]


def is_ome(description: str) -> bool:
    """Return whether the description of a TIFF file is OME-XML, complete or cut off."""
    text = description.strip("\ufeff\0 \t\r\n")
    head = text[:_HEAD]
    is_named = text.endswith("OME>") or "<OME" in head or "openmicroscopy.org" in head
    return text.startswith("<") and is_named


def parse(text: str, where: str) -> ElementTree.Element:
    """Return the root of OME-XML. `where` names the file in errors.

    Raises SourceError where the text is not OME-XML, is not well-formed, or declares entities:
    entities could refer to other files or grow without end.
    """
    if not text.lstrip("\ufeff \t\r\n").startswith("<"):
        raise SourceError(
            f"{where}: OME-XML: found none in the first plane's ImageDescription, expected a "
            "complete OME-TIFF file with its OME-XML"
        )
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise SourceError(f"{where}: OME-XML: found a DOCTYPE, expected none")
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError, RecursionError) as error:
        raise SourceError(
            f"{where}: OME-XML: {error}, expected a complete OME-TIFF file with its OME-XML"
        ) from error
    if _local(root) != "OME":
        raise SourceError(f"{where}: OME-XML: found <{_local(root):.40}>, expected <OME>")
    record_xml(root, f"the OME-XML of {Path(where).name}")
    return root


def metadata_file_of(root: ElementTree.Element) -> tuple[str, str]:
    """Return name and UUID of another file that holds the OME-XML; empty: this file holds it."""
    other = next(_children(root, "BinaryOnly"), None)
    return ("", "") if other is None else (other.get("MetadataFile", ""), other.get("UUID", ""))


def uuids_of(root: ElementTree.Element) -> Iterator[ElementTree.Element]:
    """Yield the UUID elements: each names the file of one plane or of several."""
    return (element for element in root.iter() if _local(element) == "UUID")


def files_of(root: ElementTree.Element) -> Iterator[str]:
    """Yield file names, each of one plane or of several."""
    return (uuid.get("FileName", "") for uuid in uuids_of(root) if uuid.get("FileName"))


def count_images(root: ElementTree.Element) -> int:
    """Return the number of images."""
    return sum(1 for _ in _children(root, "Image"))


def only_image(root: ElementTree.Element, index: int) -> ElementTree.Element:
    """Return OME-XML of one image: a copy without the other images and their annotations.

    The image at `index` is the first one of the copy. The copy has no image if `index` is too
    large.
    """
    images = list(_children(root, "Image"))
    kept = images[index] if 0 <= index < len(images) else None
    foreign = {name for image in images if image is not kept for name in _annotations_of(image)}
    foreign -= _annotations_of(kept) if kept is not None else set()
    found = ElementTree.Element(root.tag, root.attrib)
    found.extend(child for child in root if child is kept or _local(child) != "Image")
    for place, child in enumerate(found):
        if _local(child) == "StructuredAnnotations":
            own = ElementTree.Element(child.tag, child.attrib)
            own.extend(one for one in child if one.get("ID") not in foreign)
            found[place] = own
    return found


def _annotations_of(image: ElementTree.Element) -> set[str | None]:
    return {one.get("ID") for one in image.iter() if _local(one) == "AnnotationRef"}


def pixels_of(root: ElementTree.Element) -> ElementTree.Element | None:
    """Return the Pixels of the first image; None: there are none."""
    image = next(_children(root, "Image"), None)
    return None if image is None else next(_children(image, "Pixels"), None)


def planes_of(root: ElementTree.Element) -> list[ElementTree.Element]:
    """Return the planes of the first image that the metadata describe."""
    pixels = pixels_of(root)
    return [] if pixels is None else list(_children(pixels, "Plane"))


def positions_of(root: ElementTree.Element) -> list[float]:
    """Return PositionZ of the planes of the first channel and time, by TheZ, in any unit.

    Empty: a plane has no position, or not every TheZ has a plane.
    """
    found: dict[int, float] = {}
    for plane in planes_of(root):
        try:
            at, value = int(plane.get("TheZ", "")), float(plane.get("PositionZ", ""))
        except ValueError:
            return []
        found.setdefault(at, value)
    return [found[at] for at in sorted(found)] if sorted(found) == list(range(len(found))) else []


def modulos_of(root: ElementTree.Element) -> list[ElementTree.Element]:
    """Return the further axes (`ModuloAlongZ`, ...) of the first image.

    An annotation that no image refers to counts for all images.
    """
    images = list(_children(root, "Image"))
    refers = [_annotations_of(image) for image in images]
    found = []
    for annotation in (one for one in root.iter() if _local(one) == "XMLAnnotation"):
        name = annotation.get("ID")
        if any(name in some for some in refers) and name not in refers[0]:
            continue
        found += [one for one in annotation.iter() if _local(one).startswith("ModuloAlong")]
    return found


def samples_of(pixels: ElementTree.Element) -> int:
    """Return the samples of each pixel (3 for RGB) in the first channel."""
    channel = next(_children(pixels, "Channel"), None)
    return max(int(channel.get("SamplesPerPixel", 1)), 1) if channel is not None else 1


def tiff_data_of(
    root: ElementTree.Element,
) -> Iterator[tuple[ElementTree.Element, ElementTree.Element | None]]:
    """Yield each TiffData of the first image with its UUID; None: it has no UUID."""
    pixels = pixels_of(root)
    for data in () if pixels is None else _children(pixels, "TiffData"):
        yield data, next(_children(data, "UUID"), None)


def images_of(root: ElementTree.Element, where: str) -> list[OmeImage]:
    """Return the images with their pixels' metadata.

    Raises SourceError where a field should hold a number and doesn't.
    """
    return [_image(image, where) for image in _children(root, "Image")]


def _image(image: ElementTree.Element, where: str) -> OmeImage:
    pixels = next(_children(image, "Pixels"), None)
    if pixels is None:
        return OmeImage((None, None, None), (), ())
    channels = list(_children(pixels, "Channel"))
    return OmeImage(
        _spacing(pixels, where),
        tuple((channel.get("Name") or "").strip() or None for channel in channels),
        tuple(_color(channel, where) for channel in channels),
    )


def _spacing(pixels: ElementTree.Element, where: str) -> PartialTriple:
    lengths: list[float | None] = []
    for axis in "ZYX":
        field = f"PhysicalSize{axis}"
        given = pixels.get(field)
        um = um_per(pixels.get(f"{field}Unit", _DEFAULT_UNIT))
        if given is None or um is None:
            lengths.append(None)
            continue
        try:
            lengths.append(float(given) * um)
        except ValueError:
            raise SourceError(
                f"{where}: OME-XML: {field}: found {given!r:.40}, expected a number"
            ) from None
    z, y, x = lengths
    return z, y, x


def _color(channel: ElementTree.Element, where: str) -> Color | None:
    """Return the colour, which OME stores as a signed 32-bit number of R, G, B and A.

    Without a stated colour, the channel takes the colour of its light. White is OME-XML's default,
    which programs write if they know no colour, so the light takes precedence over white.
    """
    given, nm, dye = channel.get("Color"), _emission_nm(channel), channel.get("Fluor", "")
    if given is None:
        return color_of_light(nm, dye)
    try:
        number = int(given)
        red, green, blue, _ = (number & 0xFFFFFFFF).to_bytes(4, "big")
    except ValueError:
        raise SourceError(
            f"{where}: OME-XML: Channel Color: found {given!r:.40}, expected a whole number"
        ) from None
    by_light = color_of_light(nm, dye) if number == _DEFAULT_COLOR else None
    return by_light or color_of_channel((red, green, blue), nm, dye)


def _emission_nm(channel: ElementTree.Element) -> float | None:
    """Return the emission wavelength of a channel, nm; None: not stated."""
    per = um_per(channel.get("EmissionWavelengthUnit", "nm"))
    try:
        return None if per is None else float(channel.get("EmissionWavelength", "")) * per * 1000
    except ValueError:
        return None


def _children(element: ElementTree.Element, name: str) -> Iterator[ElementTree.Element]:
    return (child for child in element if _local(child) == name)


def _local(element: ElementTree.Element) -> str:
    """Return an element's name without its namespace, which differs between versions."""
    return element.tag.rpartition("}")[2]
