"""The program's name and version, as output files carry it."""

from importlib.metadata import version

GENERATOR = f"stereocell {version('stereocell')}"
