"""The word in a source's name that states an image of PET or SPECT.

NIfTI, MetaImage and NRRD have no field that names a tracer, and files of PET carry it in their
name, as BIDS asks for (`sub-01_pet.nii.gz`). A name may identify a patient: only the word that was
found is returned, never the name.
"""

import re
from pathlib import PurePath

_WORD = r"(?<![a-z])({})(?![a-z])"
_TRACERS = re.compile(_WORD.format("pet|spect|fdg|suv|suvbw"))
# Images that lie beside a PET, and are often named after both: the name decides nothing then.
_OTHERS = re.compile(_WORD.format(r"mra?i?|ct|cta|t[12]w?|flair|bold|dwi|anat"))


def tracer_word(source: str) -> str:
    """Return the word in the last part of a path or URL that states PET or SPECT; empty: none."""
    name = PurePath(source).name.lower()
    found = _TRACERS.search(name)
    return found[1] if found and not _OTHERS.search(name) else ""
