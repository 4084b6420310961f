"""The program's name and version, as files carry it."""

from importlib.metadata import version

GENERATOR = f"stereocell {version('stereocell')}"
