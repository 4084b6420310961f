"""Find the place of each prim in a stage. A place is a prim's role, and a key of `edit_table`."""

from collections.abc import Iterator
from contextlib import suppress

from pxr import Sdf, Usd, UsdGeom, UsdLux, UsdShade

from stereocell.model.errors import StageError
from stereocell.usd.edit_table import is_taken
from stereocell.usd.primvar_names import OBJECT_ID, PAINT
from stereocell.usd.read_additions import is_addition
from stereocell.usd.read_appearances import surface_of
from stereocell.usd.read_display import is_single, shows_display_color
from stereocell.usd.read_lights import is_light
from stereocell.usd.read_textures import vertex_values_of
from stereocell.usd.read_views import is_view
from stereocell.usd.specimen import specimen_of
from stereocell.usd.write_objects import COLUMNS, LABELS

_READER = "UsdPrimvarReader"


class Places:
    """Finds the place of a prim, which is its role in the stage, such as `tile` or `mesh`.

    bound  paths of the materials that a layer binds
    """

    def __init__(self, stage: Usd.Stage, bound: set[Sdf.Path]) -> None:
        self._stage, self._bound = stage, bound
        self._paths = specimen_of(stage)
        group = stage.GetPrimAtPath(self._paths.channels)
        self._channels = {str(prim.GetName()) for prim in group.GetChildren()}
        tiles = stage.GetPrimAtPath(self._paths.tiles).GetAllChildren()
        self._tiles = {str(prim.GetName()) for prim in tiles}
        self._drawn: dict[Sdf.Path, dict[Sdf.Path, str]] = {}

    def of(self, path: Sdf.Path) -> str:
        """Return the place of a prim; empty: the stage's readers ignore the prim."""
        paths = self._paths
        if path == paths.root:
            return "specimen"
        if path == paths.channels:
            return "channels"
        if path == paths.lights:
            return "lights"
        if path.GetParentPath() == paths.shown:
            return "shown" if path.name in self._channels else ""
        if path.HasPrefix(paths.tiles):
            is_below = path != paths.tiles
            known = self._in_tiles(str(path.MakeRelativePath(paths.tiles)).split("/") * is_below)
            if known:
                return known
        prim = self._stage.GetPrimAtPath(path)
        if not prim:
            return ""
        if is_view(prim):
            return "camera"
        if is_light(prim):
            return "sphere" if prim.IsA(UsdLux.SphereLight) else "light"
        if is_addition(prim):
            return "addition"
        if path.GetParentPath() == paths.channels:
            return "channel" if prim.IsA(UsdShade.Material) else ""
        return self._of_shading(prim)

    def _in_tiles(self, names: list[str]) -> str:
        if not names:
            return "tiles"
        if names[0] not in self._tiles or (len(names) > 1 and names[1] not in self._channels):
            return ""
        if len(names) < 3:
            return ("tile", "branch")[len(names) - 1]
        leaf = f"{names[1]}_{names[0]}"
        if len(names) == 3:
            return {leaf: "mesh", f"{leaf}_volume": "volume"}.get(names[2], "")
        return "field" if len(names) == 4 and names[2] == f"{leaf}_volume" else ""

    def _of_shading(self, prim: Usd.Prim) -> str:
        """Return the place of a material or of a shader in it; empty: nothing uses the material."""
        material = _material_over(prim)
        if material is None or not self._is_used(material):
            return ""
        if prim == material:
            return "material"
        kind = self._shaders(material).get(prim.GetPath(), "")
        return _READER if kind.startswith(_READER) else kind

    def _is_used(self, material: Usd.Prim) -> bool:
        path = material.GetPath()
        is_channels = path.GetParentPath() == self._paths.channels
        return is_channels or path.HasPrefix(self._paths.tiles) or path in self._bound

    def _shaders(self, material: Usd.Prim) -> dict[Sdf.Path, str]:
        """Return the IDs of the shaders that feed a material's surface, by path."""
        path = material.GetPath()
        if path not in self._drawn:
            surface, _, _ = UsdShade.Material(material).ComputeSurfaceSource()
            found: dict[Sdf.Path, str] = {}
            waiting = [surface] if surface else []
            while waiting:
                shader = waiting.pop()
                found[shader.GetPath()] = str(shader.GetShaderId())
                waiting += [
                    UsdShade.Shader(source.GetPrim())
                    for given in shader.GetInputs()
                    for source in given.GetValueProducingAttributes()
                    if UsdShade.Output.IsOutput(source) and source.GetPrim().GetPath() not in found
                ]
            self._drawn[path] = found
        return self._drawn[path]

    def feeds_shader(self, attribute: Usd.Attribute) -> bool:
        """Return whether an input of a material feeds a shader input that the bundle takes over."""
        material = _material_over(attribute.GetPrim())
        shaders = self._shaders(material) if material is not None else {}
        for path in shaders:
            for given in UsdShade.Shader(self._stage.GetPrimAtPath(path)).GetInputs():
                place = self.of(path)
                is_read = is_taken(place, given.GetFullName())
                if is_read and attribute in given.GetValueProducingAttributes():
                    return True
        return False


def _material_over(prim: Usd.Prim) -> Usd.Prim | None:
    while prim and not prim.IsPseudoRoot():
        if prim.IsA(UsdShade.Material):
            return prim
        prim = prim.GetParent()
    return None


def read_primvars(mesh: Usd.Prim) -> Iterator[str]:
    """Yield the names of the primvars of a tile's mesh that its objects or its material use."""
    if is_single(UsdGeom.PrimvarsAPI(mesh).GetPrimvar("displayOpacity")):
        yield "displayOpacity"
    with suppress(StageError):  # reading the mesh reports the same error
        surface = surface_of(mesh)
        yield from vertex_values_of(surface)
        if shows_display_color(surface):
            yield "displayColor"
    if not mesh.HasAttribute(LABELS):
        return
    yield from (OBJECT_ID, PAINT, "displayColor")
    stage, name = mesh.GetStage(), mesh.GetParent().GetName()
    channel = stage.GetPrimAtPath(specimen_of(stage).channels.AppendChild(name))
    columns = channel.GetAttribute(COLUMNS).Get() if channel else None
    yield from map(str, columns or ())
