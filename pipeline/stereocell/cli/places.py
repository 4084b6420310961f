"""Table of the folders that each command reads and writes.

--force and the refusal of wrong folders use it. A test checks that every command has a row, and
runs each writing command on a folder that holds other files.
"""

import argparse
from dataclasses import dataclass

from stereocell.storage.kinds import Kind

_BUILD = frozenset({Kind.BUILD})
_BUNDLE = frozenset({Kind.BUILD, Kind.BUNDLE, Kind.SITE})


@dataclass(frozen=True, slots=True)
class Places:
    """The folders of one command.

    reads   kinds of folders that OUT may be; empty: the command reads no OUT
    writes  argument that names the result; empty: the command writes nothing
    """

    reads: frozenset[Kind] = frozenset()
    writes: str = ""


PLACES = {
    "build": Places(writes="out"),
    "plan": Places(writes="out"),
    "iso": Places(writes="out"),
    "slices": Places(writes="out"),
    "units": Places(_BUILD, writes="out"),
    "stage": Places(_BUILD, writes="out"),
    "bundle": Places(_BUILD, writes="out"),
    "report": Places(_BUILD, writes="out"),
    "tissue": Places(_BUILD, writes="out"),
    "export": Places(_BUILD, writes="file"),
    "publish": Places(_BUNDLE, writes="target"),
    "check": Places(_BUNDLE | {Kind.SCENE}),
    "view": Places(_BUNDLE),
    "serve": Places(_BUNDLE),
    "sample": Places(writes="out"),
    "doctor": Places(),
    "settings": Places(),
}
FORCE = (
    "replace whatever the result would overwrite (default: replace only StereoCell's results of "
    "the same specimen)"
)


def require_place(options: argparse.Namespace) -> dict[str, str]:
    """Return the folders that remedies may name, once OUT has been found to be of the right kind.

    options  the command's arguments; `shown` is OUT as given, a path or an address

    Raises OutputError if OUT is a folder of another kind.
    """
    from stereocell.storage.shell_commands import as_shown

    places, out, shown = PLACES[options.command], options.out, as_shown(str(options.shown))
    if places.reads:
        from stereocell.storage.contents import require_kind
        from stereocell.storage.shell_commands import places_of

        return places_of(require_kind(out, places.reads), shown)
    if options.command in ("build", "plan"):
        from stereocell.building.out_folder import require_build_or_nothing

        require_build_or_nothing(out, options.input)
        return {"OUT": shown}
    return {}
