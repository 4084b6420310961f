"""The table of the folders that each command reads and writes: for --force and for wrong folders.

A test checks that every command has a row, and runs each writing command on a folder that holds
other files.
"""

import argparse
from dataclasses import dataclass

from stereocell.storage.kinds import Kind

_BUILD = frozenset({Kind.BUILD})
_BUNDLE = frozenset({Kind.BUILD, Kind.BUNDLE, Kind.SITE})


@dataclass(frozen=True, slots=True)
class Places:
    """The places of one command.

    reads   kinds of folders that OUT may be; empty: OUT is not read
    writes  the argument that names the place of the result; empty: nothing is written
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
    "replace all that lies where the result goes; without it, only StereoCell's own results of the "
    "same specimen are replaced"
)


def require_place(options: argparse.Namespace) -> dict[str, str]:
    """Return the places that remedies may name, where OUT is one that a command reads or writes.

    options  the command's arguments; `shown` is OUT as it was given: a path or an address

    Raises OutputError where OUT is another folder. Imports are lazy, so that --help is quick.
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
