"""Read settings, and values of settings, under the names that earlier versions gave them."""

from collections.abc import Mapping, Sequence
from typing import Any

from stereocell.model.errors import UsageError

COMMAND_LINE = "command line"  # name for the flags in messages
# SECTION.KEY of a setting in an earlier version: its key now, in the same section
RENAMED_KEYS = {"isovalue.rung": "level"}
# SECTION.KEY of a setting, by its present name: earlier words for its values, and the present words
RENAMED_VALUES = {"isovalue.criterion": {"ladder": "levels"}}


def with_present_names(values: Mapping[str, Any], where: str) -> tuple[dict[str, Any], list[str]]:
    """Return settings under their present names, and a line on each earlier name among them.

    values  {section: {key: value}}
    where   name for the values in messages

    Raises UsageError if a setting is given by its earlier and its present name.

    >>> with_present_names({"isovalue": {"rung": "inner"}}, "my.toml")
    ({'isovalue': {'level': 'inner'}}, ['my.toml: isovalue.rung is now called isovalue.level'])
    """
    found, lines = dict(values), []
    for section, content in values.items():
        if not isinstance(content, Mapping):
            continue
        found[section] = present = {}
        for key, value in content.items():
            name = f"{section}.{key}"
            if name in RENAMED_KEYS:
                key = RENAMED_KEYS[name]
                if key in content:
                    raise UsageError(
                        f"{where}: found {name} and {section}.{key}, which are one setting, "
                        f"expected only {section}.{key}"
                    )
                lines.append(f"{where}: {name} is now called {section}.{key}")
            name, words = f"{section}.{key}", RENAMED_VALUES.get(f"{section}.{key}", {})
            if isinstance(value, str) and value in words:
                lines.append(f"{where}: {name}: {value!r} is now called {words[value]!r}")
                value = words[value]
            present[key] = value
    return found, lines


def print_earlier_names(lines: Sequence[str]) -> None:
    """Print the lines on earlier names."""
    if lines:
        from stereocell.engine.run import console  # slow to import

        console.print("\n".join(lines), markup=False)
