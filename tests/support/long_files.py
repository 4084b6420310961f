"""Files that take 10 to 30 s because they have many tests, although none of these is slow."""

from pathlib import Path

_TESTS = Path(__file__).parents[1]
LONG_FILES = [
    _TESTS / f"{name}.py"
    for name in (
        "building/test_stated_level",
        "isosurface/test_channel_level",
        "objects/test_label_rule",
        "objects/test_interfaces",
        "preview/test_iso_value",
        "report/test_page",
        "system/test_doctor",
        "verify/test_formats",
    )
]
