"""Read the lights that a user's layers edit or add: lamps, and the light of the surroundings.

Distant lights and sphere lights become lamps of the viewer. All dome lights together become the
light of the surroundings (`room`). If no layer edits the lights, or if no light is left, the viewer
uses its own lamps, which hang over the user's shoulder. It does not use the lights of the build.

A lamp's strength is the radiance of a white, matt surface in the specimen's middle that faces the
lamp, in the units of UsdLux. The light of a sphere falls off with the square of the distance from
its middle, as that of a point light.

References: OpenUSD, UsdLux, https://openusd.org/release/api/usd_lux_page_front.html
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import pi, radians, sin
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdGeom, UsdLux

from stereocell.formats.latlong import Radiance, read_latlong, turned
from stereocell.model.errors import StageError
from stereocell.storage.assets import find_asset
from stereocell.usd.drawn_prims import is_visible, to_world
from stereocell.usd.layer_opinions import defined_prims
from stereocell.usd.read_attributes import Point, file_of, require_still, value_of
from stereocell.usd.specimen import Specimen, specimen_of

MAX_LAMPS = 3  # largest number of lamps in the viewer
MAX_STRENGTH = 10.0  # largest strength of a lamp in the viewer; stronger lamps are dimmed to it
# Smallest distance of a lamp, as a share of the specimen's longest edge; a nearer lamp is as bright
# as one at this distance
_NEAREST = 0.25
_KINDS = (UsdLux.DistantLight, UsdLux.SphereLight, UsdLux.DomeLight, UsdLux.DomeLight_1)
# Values that are supported for a dome's image: its projection, and the axis of its poles
_KNOWN = {"inputs:texture:format": ("latlong", "automatic"), "poleAxis": ("Y", "scene")}
_WHITE = (1.0, 1.0, 1.0)

# Inputs that decide the brightness and the colour of a light
INPUTS = (
    "inputs:color",
    "inputs:intensity",
    "inputs:exposure",
    "inputs:normalize",
    "inputs:angle",
    "inputs:radius",
    "inputs:enableColorTemperature",
    "inputs:colorTemperature",
    "inputs:texture:file",
    *_KNOWN,
)


@dataclass(frozen=True, slots=True)
class StageLamp:
    """A lamp of the viewer, made from a light of the stage.

    color     linear RGB; the largest of the three is 1
    strength  radiance of a white surface that the lamp lights, see the module's docstring
    towards   unit vector (x, y, z) to a distant lamp, world; None for a sphere
    position  place of a sphere, um, world; None for a distant lamp
    """

    name: str
    color: Point
    strength: float
    towards: Point | None = None
    position: Point | None = None


@dataclass(frozen=True, slots=True)
class StageLights:
    """The light of a stage as the viewer shows it: lamps, and the light of the surroundings.

    lamps  the strongest lamps, at most MAX_LAMPS, strongest first
    lost   names of the weaker lamps, which are left out
    room   image of the radiance of all domes together; None: the stage has no dome
    """

    lamps: tuple[StageLamp, ...]
    lost: tuple[str, ...]
    room: Radiance | None


def is_light(prim: Usd.Prim) -> bool:
    """Return whether a prim is a light below /Specimen of a kind that the viewer has."""
    root = specimen_of(prim.GetStage()).root
    return prim.GetPath().HasPrefix(root) and any(prim.IsA(kind) for kind in _KINDS)


def visible_lights(stage: Usd.Stage) -> Iterator[Usd.Prim]:
    """Yield the prims of all visible lights below /Specimen, in the stage's order."""
    for prim in defined_prims(stage):
        if is_light(prim) and is_visible(prim):
            yield prim


def read_lights(
    stage: Usd.Stage,
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    require: Callable[[Path], Path],
) -> StageLights | None:
    """Return the light of a stage; None: there is none, or only the unchanged light of the build.

    low, high  corners of the specimen's box (x, y, z), um, world
    require    called with each file before it is read; returns it, or raises StageError if it is
               damaged

    Raises StageError for values over time, and for an image that can't be read.
    """
    lights = list(visible_lights(stage))
    root = specimen_of(stage).root
    if not lights or _descriptions(lights, root) == _built_descriptions():
        return None
    middle, longest = (low + high) / 2, float((high - low).max())
    lamps: list[StageLamp] = []
    room: Radiance | None = None
    for light in lights:
        require_still(*light.GetAuthoredAttributes())
        radiance = _radiance(light)
        if light.IsA(UsdLux.DistantLight) or light.IsA(UsdLux.SphereLight):
            lamps.append(_lamp_of(light, radiance, middle, longest))
        else:
            own = _room_of(light, radiance, require)
            room = own if room is None else _sum_of(room, own)
    lamps = sorted((lamp for lamp in lamps if lamp.strength > 0), key=lambda lamp: -lamp.strength)
    lost = tuple(lamp.name for lamp in lamps[MAX_LAMPS:])
    return StageLights(tuple(lamps[:MAX_LAMPS]), lost, room)


def notes_on_lights(lights: StageLights | None) -> Iterator[str]:
    """Yield a message for each lamp that is left out or dimmed."""
    for name in lights.lost if lights else ():
        yield (
            f"light {name!r} is not taken over: the viewer has {MAX_LAMPS} lamps, and other lights "
            "are brighter"
        )
    for lamp in lights.lamps if lights else ():
        if lamp.strength > MAX_STRENGTH:
            yield (
                f"brightness of light {lamp.name!r}, {lamp.strength:.3g}, is not taken over: a "
                f"lamp of the viewer is at most {MAX_STRENGTH:g} times as bright as a white surface"
            )


def _descriptions(lights: list[Usd.Prim], root: Sdf.Path) -> dict[str, tuple[object, ...]]:
    """Return a comparable description of each light, by its path below the specimen."""
    paths = [str(light.GetPath().MakeRelativePath(root)) for light in lights]
    return {path: _description(light, root) for path, light in zip(paths, lights, strict=True)}


def _description(light: Usd.Prim, root: Sdf.Path) -> tuple[object, ...]:
    attributes = [
        attribute
        for attribute in light.GetAuthoredAttributes()
        if attribute.GetName() in INPUTS or attribute.GetName().startswith("xformOp")
    ]
    values = []
    for attribute in sorted(attributes, key=Usd.Attribute.GetName):
        value = attribute.Get()
        if isinstance(value, Sdf.AssetPath):
            value = Path(value.resolvedPath).read_bytes() if value.resolvedPath else value.path
        values.append((attribute.GetName(), value, attribute.GetNumTimeSamples()))
    above = light.GetStage().GetPrimAtPath(root)
    place, _ = UsdGeom.XformCache().ComputeRelativeTransform(light, above)
    return light.GetTypeName(), tuple(values), place


def _built_descriptions() -> dict[str, tuple[object, ...]]:
    built = Usd.Stage.Open(str(find_asset("usd_assets/lights.usda")))
    lights = [prim for prim in Usd.PrimRange.AllPrims(built.GetPseudoRoot()) if is_light(prim)]
    return _descriptions(lights, Specimen().root)


def _radiance(light: Usd.Prim) -> NDArray[np.float64]:
    """Return a light's radiance (r, g, b), before `normalize` and a dome's image are applied."""
    intensity, exposure = (_number(light, name) for name in ("intensity", "exposure"))
    color = np.array(value_of(light, "inputs:color", Sdf.ValueTypeNames.Color3f), np.float64)
    api = UsdLux.LightAPI(light)
    if api.GetEnableColorTemperatureAttr().Get():
        kelvin = _number(light, "colorTemperature")
        color *= np.array(UsdLux.BlackbodyTemperatureAsRgb(kelvin))
    if intensity < 0 or color.min() < 0:
        raise StageError(
            f"{light.GetPath()}: found an intensity of {intensity:g} and a color of "
            f"{', '.join(f'{part:g}' for part in color)}, expected numbers of 0 or more"
        )
    return np.asarray(color * intensity * 2.0**exposure)


def _number(light: Usd.Prim, name: str) -> float:
    return float(value_of(light, f"inputs:{name}", Sdf.ValueTypeNames.Float))


def _lamp_of(
    light: Usd.Prim, radiance: NDArray[np.float64], middle: NDArray[np.float64], longest: float
) -> StageLamp:
    matrix = to_world(light)
    is_normalized = bool(UsdLux.LightAPI(light).GetNormalizeAttr().Get())
    towards = position = None
    if light.IsA(UsdLux.DistantLight):
        angle = _number(light, "angle")
        # `size` is the projected solid angle. It is 0 for parallel light, which is not scaled.
        size = pi * sin(radians(min(max(angle, 0.0), 180.0)) / 2) ** 2
        irradiance = radiance if is_normalized or size == 0 else radiance * size
        towards = _unit(matrix[2, :3])
    else:
        scale = abs(float(np.linalg.det(matrix[:3, :3]))) ** (1 / 3)
        area = 4 * pi * (_number(light, "radius") * scale) ** 2
        intensity = radiance / 4 if is_normalized else radiance * area / 4
        position = _point(matrix[3, :3])
        distance = max(float(np.linalg.norm(matrix[3, :3] - middle)), _NEAREST * longest)
        irradiance = intensity / distance**2
    strength = float(irradiance.max()) / pi
    color = irradiance / irradiance.max() if strength > 0 else np.array(_WHITE)
    name = str(light.GetDisplayName() or light.GetName())
    return StageLamp(name, _point(color), round(strength, 6), towards, position)


def _room_of(
    light: Usd.Prim, radiance: NDArray[np.float64], require: Callable[[Path], Path]
) -> Radiance:
    """Return the radiance of a dome as an image (rows from the top, columns, 3), in the world."""
    attribute = light.GetAttribute("inputs:texture:file")
    asset = attribute.Get()
    if asset is None or not asset.path:
        return np.broadcast_to(radiance, (1, 2, 3)).astype(np.float32)
    for name, known in _KNOWN.items():
        found = light.GetAttribute(name).Get() if light.HasAttribute(name) else known[0]
        if found not in known:
            raise StageError(
                f"{light.GetPath()}.{name}: found {found!r}, expected {' or '.join(known)}: "
                "convert the image"
            )
    image = read_latlong(require(file_of(attribute)))
    return turned(image, to_world(light)[:3, :3]) * radiance.astype(np.float32)


def _sum_of(one: Radiance, other: Radiance) -> Radiance:
    """Return the sum of two images of radiance, at the resolution of the finer one."""
    fine, coarse = (one, other) if one.shape[0] >= other.shape[0] else (other, one)
    rows, columns = (
        (np.arange(fine.shape[axis]) * coarse.shape[axis]) // fine.shape[axis] for axis in (0, 1)
    )
    return np.asarray(fine + coarse[np.ix_(rows, columns)])


def _unit(vector: NDArray[np.float64]) -> Point:
    return _point(vector / np.linalg.norm(vector))


def _point(values: NDArray[np.float64]) -> Point:
    x, y, z = (round(float(value), 6) for value in values)
    return x, y, z
