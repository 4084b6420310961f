"""Find the opinions of a user's layers that a bundle does not take over, and the reason for each.

`layer_opinions` yields all opinions over the built stage. `edit_table` lists those that the readers
take over. All others are lost edits, except an opinion that repeats the stage's own value. An
animated value at a place that would be taken over is an error.

Files for other programs contain less than a bundle. Their formats add reasons by a `LeftOut`
function.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from difflib import get_close_matches
from enum import Enum
from pathlib import Path

from pxr import Sdf, Sdr, Tf, Usd, UsdGeom, UsdShade

from stereocell.model.errors import StageError
from stereocell.usd.edit_places import Places, read_primvars
from stereocell.usd.edit_table import ADDED, ASSUMED, DERIVED, TAKEN, is_taken, reason_of
from stereocell.usd.layer_opinions import (
    BELOW_INSTANCE,
    BuiltLayers,
    Opinion,
    opinions_of_users,
)
from stereocell.usd.read_attributes import over_time
from stereocell.usd.read_bindings import binding_fault
from stereocell.usd.specimen import specimen_of

_BINDING = "material:binding"
_COLLECTION = "collection:"
# Places where a bound material needs no `strongerThanDescendants`: no prim below has a binding
_OWN_BINDING = ("mesh", "addition", "group")
_MOST_LINES = 3  # largest number of similar edits with a line each; more of them share one line
_GROUPS = ("Xform", "Scope", "")  # types of prims that only group other prims
_FLAT = (
    "found a flattened stage, which hides the edits that no bundle takes over, expected a layer "
    "over stage.usda: export such a layer"
)
_BUILT = "built"  # place of prims that the build wrote and that no reader uses


WHOLE = "@specifier"  # name of an edit that concerns a whole prim, not one of its properties
# Takes a place and a name of `edit_table`, and returns why a file format leaves out such an edit;
# empty: the format can hold the edit
LeftOut = Callable[[str, str], str]


def _nothing(_place: str, _name: str) -> str:
    return ""


class _Fate(Enum):
    """The reason why no message reports an opinion, although a layer states it."""

    TAKEN = 1  # the bundle takes it over
    COVERED = 2  # another message reports it: on its prim, or on the prims in its group


@dataclass(frozen=True, slots=True)
class LostEdit:
    """An edit of a user's layer that no bundle takes over.

    what    the prim with the property or the metadata, in the words of the message
    name    name of the property or the metadata; edits of one name and reason are similar
    reason  why the edit is lost
    """

    what: str
    name: str
    reason: str


def describe(lost: Iterable[LostEdit]) -> Iterator[str]:
    """Yield a line for each edit; more than three similar edits share one line."""
    groups: dict[tuple[str, str], list[LostEdit]] = defaultdict(list)
    for edit in lost:
        groups[edit.name, edit.reason].append(edit)
    for alike in groups.values():
        shown = alike if len(alike) <= _MOST_LINES else alike[:1]
        more = len(alike) - len(shown)
        others = f" (and {more} similar ones)" if more else ""
        for edit in shown:
            yield f"{edit.what}{others} is not taken over: {edit.reason}"


def notes_on_edits(stage: Usd.Stage, left_out: LeftOut = _nothing) -> Iterator[str]:
    """Yield a line on each lost edit. Raises StageError for an animated value."""
    built = BuiltLayers(stage)
    if built:
        yield from describe(find_lost_edits(stage, built, left_out))
    else:
        yield f"{stage.GetRootLayer().realPath}: {_FLAT}"


def require_no_lost_edit(
    stage: Usd.Stage,
    more: Iterable[str] = (),
    *,
    left_out: LeftOut = _nothing,
    taker: str = "no bundle takes over",
) -> None:
    """Raise StageError if an edit is lost, or if the stage is flattened, which hides its edits.

    more   messages on edits that are lost in part
    taker  words of the message after "edits that"
    """
    layer, built = Path(stage.GetRootLayer().realPath), BuiltLayers(stage)
    if not built:
        raise StageError(f"{layer}: {_FLAT}")
    found = [*describe(find_lost_edits(stage, built, left_out)), *more]
    if found:
        words = "1 edit" if len(found) == 1 else f"{len(found)} edits"
        lines = "\n".join(found)
        raise StageError(
            f"{lines}\n{layer}: found {words} that {taker}, expected none with --strict: remove "
            "the edits or leave out --strict; nothing was written"
        )


def find_lost_edits(
    stage: Usd.Stage, built: BuiltLayers, left_out: LeftOut = _nothing
) -> list[LostEdit]:
    """Return the lost edits, in the stage's order. Raises StageError for an animated value."""
    finder = _Finder(stage, built, _bound_materials(stage, built), left_out)
    for prim, opinion in opinions_of_users(stage, built):
        finder.add(prim, opinion)
    return finder.lost()


def _sources_of_colors(stage: Usd.Stage) -> set[Sdf.Path]:
    """Return the attributes outside of the channels that a channel's colour is connected to."""
    group = stage.GetPrimAtPath(specimen_of(stage).channels)
    inputs = [UsdShade.Material(prim).GetInput("color") for prim in group.GetChildren()]
    found = {
        source.GetPath()
        for given in inputs
        if given
        for source in given.GetValueProducingAttributes()
    }
    return {path for path in found if not path.HasPrefix(group.GetPath())}


def _bound_materials(stage: Usd.Stage, built: BuiltLayers) -> set[Sdf.Path]:
    return {
        target
        for prim, opinion in opinions_of_users(stage, built)
        if opinion.name.startswith(_BINDING)
        for target in prim.GetRelationship(opinion.name).GetTargets()
    }


class _Finder:
    """Decides for each opinion of a user's layer whether a bundle loses it.

    An opinion on a class reaches several prims by inheritance. It counts once.
    """

    def __init__(
        self, stage: Usd.Stage, built: BuiltLayers, bound: set[Sdf.Path], left_out: LeftOut
    ) -> None:
        self._built, self._left_out, self._bound = built, left_out, bound
        self._specimen = specimen_of(stage)
        self._feeding = _sources_of_colors(stage)
        self._places = Places(stage, bound)
        self._found: dict[tuple[str, str], list[LostEdit | _Fate]] = {}
        self._covered: set[Sdf.Path] = set()

    def add(self, prim: Usd.Prim, opinion: Opinion) -> None:
        """Decide, and keep, whether an opinion is lost at one of the prims that it reaches."""
        edit = self._judge(prim, opinion)
        self._found.setdefault(opinion.source, []).append(edit)

    def lost(self) -> list[LostEdit]:
        """Return the opinions that no prim takes over, one edit for each."""
        kept: dict[LostEdit, None] = {}
        for fates in self._found.values():
            edits = [fate for fate in fates if isinstance(fate, LostEdit)]
            if edits and _Fate.TAKEN not in fates:
                root = str(self._specimen.root)
                kept[next((edit for edit in edits if root in edit.what), edits[0])] = None
        return list(kept)

    def _judge(self, prim: Usd.Prim, opinion: Opinion) -> LostEdit | _Fate:
        """Return an opinion as a lost edit of one of its prims, or why it is not reported."""
        path, name = opinion.prim, opinion.name
        if any(path.HasPrefix(one) for one in self._covered):
            return _Fate.COVERED
        own = prim.GetStage().GetPrimAtPath(path)
        if name == BELOW_INSTANCE:
            reason = f"USD ignores opinions below an instance: set instanceable of {prim.GetPath()}"
            return LostEdit(str(path), name, f"{reason} to false")
        if path.AppendProperty(name.lstrip("@")) in self._feeding or (
            name == WHOLE and path in {one.GetPrimPath() for one in self._feeding}
        ):
            return _Fate.TAKEN
        place = self._places.of(path) or self._built_place(own) or _place_of_group(own)
        if not place:
            return self._judge_prim(path, prim, opinion)
        if opinion.variant:
            return LostEdit(
                f"variant {opinion.variant} on {prim.GetPath()}",
                "variant",
                "its layer does not list the set: write `prepend variantSets` there"
                if opinion.is_unlisted
                else "it is not selected",
            )
        if reason := self._left_out(place, WHOLE):
            self._covered.add(path)
            return LostEdit(f"{own.GetTypeName()} {path}", str(own.GetTypeName()), reason)
        reason = self._fault(place, own, opinion)
        if not reason and (left_out := self._left_out(place, name)):
            reason = "" if self._repeats(own.GetAttribute(name), opinion.spec) else left_out
        if name == WHOLE or not reason:
            return _Fate.TAKEN
        return LostEdit(_words_for(prim, path, name), name, reason)

    def _built_place(self, prim: Usd.Prim) -> str:
        if not prim or not prim.GetPath().HasPrefix(self._specimen.root):
            return ""
        is_built = any(spec.layer in self._built for spec in prim.GetPrimStack())
        return _BUILT if is_built else ""

    def _judge_prim(self, path: Sdf.Path, prim: Usd.Prim, opinion: Opinion) -> LostEdit | _Fate:
        """Return an opinion on a prim that no reader uses as a lost edit, or as covered."""
        own = prim.GetStage().GetPrimAtPath(path)
        if own and not own.IsDefined() and not own.IsAbstract():
            self._covered.add(path)
            parent = own.GetParent()
            names = [str(child.GetName()) for child in parent.GetChildren()]
            return LostEdit(
                str(path), "prim", f"the stage has no such prim{_hint(path.name, names)}"
            )
        if not own and prim.IsActive() and not opinion.variant:
            self._covered.add(path)
            return LostEdit(str(path), "prim", "it is in a variant that is not selected")
        kind = str(own.GetTypeName()) if own else ""
        if kind in _GROUPS and not (own and own.IsAbstract()):
            return _Fate.COVERED  # messages on the prims in the group are enough
        self._covered.add(path)
        if not path.HasPrefix(self._specimen.root):
            reason = f"it lies outside {self._specimen.root}"
            return LostEdit(f"{kind or 'prim'} {path}", kind, reason)
        reason = next(
            (why for known, why in ADDED.items() if kind == known or kind.endswith(known)),
            "the bundle uses no prims of this type",
        )
        return LostEdit(f"{kind} {path}", kind, reason)

    def _fault(self, place: str, prim: Usd.Prim, opinion: Opinion) -> str:
        """Return why an opinion is lost; empty: it is taken over, or changes nothing."""
        name = opinion.name
        if name.startswith(_BINDING):
            if place in ("specimen", "tiles", "tile", "branch", *_OWN_BINDING):
                is_own = place in _OWN_BINDING
                return binding_fault(prim, prim.GetRelationship(name), is_own=is_own)
        elif self._is_read(place, prim, name):
            return self._weakness(prim, opinion)
        if name.startswith(_COLLECTION) and self._is_bound(prim, name):
            return ""
        attribute = prim.GetAttribute(name)
        if attribute and self._repeats(attribute, opinion.spec):
            return ""
        derived = DERIVED.get(place, {})
        if name in derived:
            return derived[name] and f"it is computed from other values: edit {derived[name]}"
        if reason := reason_of(name):
            return reason
        if attribute and _fallback(attribute) is not None:
            return "the bundle does not use it"
        return f"no reader knows this name{_hint(name, TAKEN.get(place, ()))}"

    def _is_bound(self, prim: Usd.Prim, name: str) -> bool:
        """Return whether a material is bound to the collection that a property belongs to."""
        collection = ":".join(name.split(":")[:2])
        return prim.GetPath().AppendProperty(collection) in self._bound

    def _is_read(self, place: str, prim: Usd.Prim, name: str) -> bool:
        if is_taken(place, name):
            return True
        attribute = prim.GetAttribute(name)
        if place == "mesh" and name.startswith("primvars:"):
            return name.split(":")[1] in read_primvars(prim)
        if name.startswith("inputs:") and place in ("material", "channel"):
            return bool(attribute) and self._places.feeds_shader(attribute)
        is_fed = bool(attribute) and attribute.HasAuthoredConnections()
        return is_fed and is_taken(f"{place}, fed", name)

    def _weakness(self, prim: Usd.Prim, opinion: Opinion) -> str:
        """Return why an opinion has no effect although its name is read; empty: it has one."""
        attribute, spec = prim.GetAttribute(opinion.name), opinion.spec
        if not attribute or not isinstance(spec, Sdf.AttributeSpec):
            return ""
        if {"timeSamples", "spline"} & set(spec.ListInfoKeys()):
            raise StageError(over_time(attribute))
        if not spec.HasDefaultValue():
            return ""
        if attribute.HasAuthoredConnections() and not spec.HasInfo("connectionPaths"):
            sources = ", ".join(map(str, attribute.GetConnections()))
            return f"a connection to {sources} gives its value"
        stack = attribute.GetPropertyStack(Usd.TimeCode.Default())
        for stronger in stack[: stack.index(spec)] if spec in stack else ():
            if stronger.HasDefaultValue() and stronger.layer in self._built:
                file = Path(stronger.layer.realPath).name
                return f"the stage's own value in {file} is stronger"
        if opinion.name.startswith("xformOp:"):
            order = UsdGeom.Xformable(prim).GetXformOpOrderAttr().Get() or ()
            if opinion.name not in {str(name).removeprefix("!invert!") for name in order}:
                return "xformOpOrder does not name it"
        return ""

    def _repeats(self, attribute: Usd.Attribute, spec: Sdf.Spec) -> bool:
        """Return whether an opinion repeats the value of the build, or else the type's default.

        The default counts only if the build states no value.
        """
        if not attribute or not isinstance(spec, Sdf.AttributeSpec) or not spec.HasDefaultValue():
            return False
        below = [
            one.default
            for one in attribute.GetPropertyStack(Usd.TimeCode.Default())
            if one.layer in self._built and one.HasDefaultValue()
        ]
        usual = ASSUMED.get(attribute.GetName(), below[0] if below else _fallback(attribute))
        return usual is not None and bool(spec.default == usual)


def _place_of_group(prim: Usd.Prim) -> str:
    """Return the place `group` for a group below /Specimen; empty for any other prim."""
    is_group = prim and prim.IsDefined() and not prim.IsAbstract() and prim.GetTypeName() in _GROUPS
    is_below = is_group and prim.GetPath().HasPrefix(specimen_of(prim.GetStage()).root)
    return "group" if is_below else ""


def _words_for(prim: Usd.Prim, path: Sdf.Path, name: str) -> str:
    if name.startswith("@"):
        return f"{name[1:]} of {path}"
    if name.startswith(_BINDING) and (targets := prim.GetRelationship(name).GetTargets()):
        return f"material {targets[-1]}, bound on {path},"
    return f"{path}.{name}"


def _fallback(attribute: Usd.Attribute) -> object:
    """Return an attribute's default by its prim's or shader's type; None: it has no default."""
    prim, name = attribute.GetPrim(), attribute.GetName()
    if prim.IsA(UsdShade.Shader) and name.startswith("inputs:"):
        node = Sdr.Registry().GetShaderNodeByIdentifier(str(UsdShade.Shader(prim).GetShaderId()))
        given = node.GetShaderInput(name.removeprefix("inputs:")) if node else None
        return given.GetDefaultValueAsSdfType() if given else None
    try:
        return prim.GetPrimDefinition().GetAttributeFallbackValue(name)
    except Tf.ErrorException:
        return None


def _hint(name: str, known: Iterable[str]) -> str:
    plain = {one.lower(): one for one in known if not one.startswith("@") and "*" not in one}
    close = get_close_matches(name.lower(), plain, 1, 0.75)
    return f": did you mean {plain[close[0]]}?" if close else ""
