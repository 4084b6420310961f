"""The program's name and version, for output files."""

from importlib.metadata import version

GENERATOR = f"stereocell {version('stereocell')}"
