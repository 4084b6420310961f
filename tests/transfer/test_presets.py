"""Each transfer function of a build has a title and an explanation, which the viewer shows."""

import pkgutil
import re
from importlib import import_module

import numpy as np

from stereocell import transfer
from stereocell.transfer.ct_tissues import tissue_functions
from stereocell.transfer.opacity import make_transfer_functions
from stereocell.transfer.presets import PRESETS


def _functions_of_two_dimensions() -> set[str]:
    modules = [
        import_module(f"stereocell.transfer.{found.name}")
        for found in pkgutil.iter_modules(transfer.__path__)
    ]
    return {str(module.NAME) for module in modules if hasattr(module, "NAME")}


def test_the_table_names_the_functions_that_a_build_makes() -> None:
    general = make_transfer_functions(np.ones(256, np.int64), 0.5, threshold_normalized=0.4)
    made = {*general, *tissue_functions((-1024.0, 3071.0)), *_functions_of_two_dimensions()}
    assert len(made) > 10
    assert set(PRESETS) == made


def test_titles_differ_and_explanations_are_sentences() -> None:
    assert len({preset.title for preset in PRESETS.values()}) == len(PRESETS)
    for preset in PRESETS.values():
        assert re.fullmatch(r"[A-Z].*[^.]", preset.title)
        assert re.fullmatch(r"[A-Z].*\.", preset.sentence)
