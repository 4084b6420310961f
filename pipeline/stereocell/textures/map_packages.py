"""The packages of the extra `maps`: xatlas unwraps surfaces, alktx2 encodes Basis Universal."""

from typing import Any

from stereocell.model.extra_packages import import_extra, version_of

UNWRAPPER, ENCODER = "xatlas", "alktx2"


def import_unwrapper() -> Any:
    """Return xatlas. Raises UsageError with the command to install it if it is missing."""
    return import_extra(UNWRAPPER, extra="maps", wanted_by="unwrap.maps")


def import_encoder() -> Any:
    """Return alktx2. Raises UsageError with the command to install it if it is missing."""
    return import_extra(ENCODER, extra="maps", wanted_by="a surface with baked maps")


def require_map_packages() -> None:
    """Raise UsageError if a package for baked maps is missing, before any work is done."""
    for package in (UNWRAPPER, ENCODER):
        import_extra(package, extra="maps", wanted_by="unwrap.maps")


def unwrapper_version() -> str:
    """Return the version of xatlas. Raises UsageError if it is missing."""
    import_unwrapper()
    return version_of(UNWRAPPER)


def encoder_version() -> str:
    """Return the version of alktx2; empty if it is not installed."""
    return version_of(ENCODER)
