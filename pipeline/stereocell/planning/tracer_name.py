"""Find the word in a source's name that states a PET or SPECT.

NIfTI, MetaImage and NRRD have no field for the tracer. Files of PET have it in their name, as BIDS
requires (`sub-01_pet.nii.gz`). A name may identify a patient, so only the word is returned.
"""

import re
from pathlib import PurePath

_WORD = r"(?<![a-z])({})(?![a-z])"
_TRACERS = re.compile(_WORD.format("pet|spect|fdg|suv|suvbw"))
# Names of images that lie beside a PET. A name with both kinds of word decides nothing.
_OTHERS = re.compile(_WORD.format(r"mra?i?|ct|cta|t[12]w?|flair|bold|dwi|anat"))


def tracer_word(source: str) -> str:
    """Return the word in the last part of a path or URL that states PET or SPECT; empty: none.

    >>> tracer_word("data/sub-01_pet.nii.gz")
    'pet'
    """
    name = PurePath(source).name.lower()
    found = _TRACERS.search(name)
    return found[1] if found and not _OTHERS.search(name) else ""
