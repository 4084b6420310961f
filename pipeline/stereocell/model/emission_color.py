"""Choose the colour of fluorescence by its wavelength, or by the dye in a channel's name.

Each band of the spectrum has one colour, close to that of its light but light enough to be shaded.
Emission maxima of dyes are those that their makers and FPbase publish, rounded.
"""

import re

from stereocell.model.color import linear_color

Color = tuple[float, float, float]

# Upper end of a band in nm, and its colour in sRGB. Far red and infrared light, which is invisible,
# is shown in pink.
_BANDS = (
    (435.0, 0x8F6CF2),
    (480.0, 0x4F70F5),
    (505.0, 0x5CD6E8),
    (545.0, 0x66D96C),
    (575.0, 0xF0CD3C),
    (600.0, 0xF29A45),
    (645.0, 0xEE5548),
    (720.0, 0xE864B4),
    (2000.0, 0xB08CA8),
)
_SHORTEST_NM = 300.0  # nm; a smaller number is not the emission of a dye

# Families of dyes that are named after the light they emit or absorb, in nm. BODIPY has both
# numbers, or only the last one.
_BY_EMISSION = re.compile(
    r"(?<![a-z])(?:qdot|quantum dot|qd|bu?v|bb|brilliant (?:ultra ?)?(?:violet|blue)|super bright"
    r"|e ?fluor|opal|m?irfp|bodipy(?: [0-9]{3})?) ?([3-9][0-9]{2})(?![0-9])"
)
_BY_EXCITATION = re.compile(
    r"(?<![a-z])(?:atto|cf|dylight|jfx?|janelia ?fluor|i ?fluor|hilyte(?: ?fluor)?|ir ?dye"
    r"|(?:abberior )?star|dyomics|dy|chromeo) ?([3-9][0-9]{2})(?![0-9])"
)
_SHIFT_NM = 20.0  # nm from absorption to emission of such a dye; 10 to 35 in reality
_VISIBLE_NM = 400.0  # nm; dyes that absorb shorter light emit at about _BLUE_NM
_BLUE_NM = 442.0  # nm

# Stains that are named after a colour, and the emission maximum of each colour in nm
_BY_WORD = re.compile(
    r"(?<![a-z])(?:sytox(?: aadvanced)?|(?:mito|lyso|er|cell) ?tracker|cell ?mask|cell ?trace"
    r"|zombie|live dead(?: fixable)?) ?(violet|blue|green|yellow|orange|deep red|far red|red)"
)
_WORDS_NM = {
    "violet": 430, "blue": 460, "green": 520, "yellow": 560, "orange": 580, "red": 610,
    "deep red": 665, "far red": 665,
}  # fmt: skip

# Emission maximum in nm, by a pattern for names in lower case with single spaces
_DYES = tuple(
    (re.compile(rf"(?<![a-z])(?:{pattern})(?![a-z0-9]|\.[0-9])"), nm)
    for pattern, nm in {
        r"dapi": 461,
        r"hoechst ?(?:33258|33342|34580)?": 461,
        r"[em]?bfp2?": 448,
        r"(?:alexa ?(?:fluor)?|af|a) ?350": 442,
        r"(?:alexa ?(?:fluor)?|af|a) ?405": 421,
        r"m?cerulean3?|[em]?cfp|m?turquoise2?": 475,
        r"(?:alexa ?(?:fluor)?|af|a) ?488": 519,
        r"(?:e|em|sf|t|z|m)?gfp|m?neongreen|m?clover": 510,
        r"fitc|fluorescein|fam|cy ?2|calcein|bodipy fl|oregon green": 520,
        r"gcamp[0-9a-z]*": 512,
        r"[em]?yfp|m?venus|m?citrine": 528,
        r"(?:alexa ?(?:fluor)?|af|a) ?532": 554,
        r"(?:alexa ?(?:fluor)?|af|a) ?(?:546|555)": 567,
        r"cy ?3|tritc|rhodamine|tmr|(?:m|m?k)orange2?": 570,
        r"tdtomato|dsred2?|tagrfp|m?rfp": 583,
        r"(?:alexa ?(?:fluor)?|af|a) ?(?:568|594)|texas red|cy ?3\.5|bodipy tr": 610,
        r"m?cherry2?|mscarlet[0-9i]*|mruby[0-9]?|propidium iodide": 610,
        r"(?:alexa ?(?:fluor)?|af|a) ?(?:633|635|647|660)|cy ?5|apc|draq ?5|to ?pro ?3": 667,
        r"percp|sir(?: ?(?:dna|actin|tubulin))?|mplum|mkate2?": 665,
        r"(?:alexa ?(?:fluor)?|af|a) ?(?:680|700)|cy ?5\.5": 700,
        r"(?:alexa ?(?:fluor)?|af|a) ?(?:750|790)|cy ?7|indocyanine green|icg": 780,
    }.items()
)


def color_of_wavelength(nm: float) -> Color | None:
    """Return the colour (linear RGB) of light of this wavelength; None: no dye emits such light."""
    if not _SHORTEST_NM <= nm <= _BANDS[-1][0]:
        return None
    code = next(code for end, code in _BANDS if nm <= end)
    return linear_color((code >> 16, code >> 8 & 255, code & 255))


def emission_of(name: str) -> float | None:
    """Return the emission maximum in nm of the dye in a channel's name; None: it names no dye.

    >>> emission_of("Alexa Fluor 488"), emission_of("CD31")
    (519.0, None)
    """
    plain = " ".join(re.sub(r"[^a-z0-9.]+", " ", name.lower()).split())
    if (found := _BY_EMISSION.search(plain)) is not None:
        return float(found[1])
    if (found := _BY_EXCITATION.search(plain)) is not None:
        absorbed = float(found[1])
        return _BLUE_NM if absorbed < _VISIBLE_NM else absorbed + _SHIFT_NM
    if (found := _BY_WORD.search(plain)) is not None:
        return float(_WORDS_NM[found[1]])
    return next((float(nm) for pattern, nm in _DYES if pattern.search(plain)), None)


def color_of_name(name: str) -> Color | None:
    """Return the colour (linear RGB) of the dye in a channel's name; None: it names no dye."""
    nm = emission_of(name)
    return None if nm is None else color_of_wavelength(nm)


def color_of_channel(
    rgb: tuple[int, int, int] | None, nm: float | str | None, dye: str = ""
) -> Color | None:
    """Return the colour (linear RGB) that a file states, or else the colour of its light.

    rgb  sRGB, 0..255; None: not stated. Black counts as not stated, because it is invisible, and
         some programs write it if there is no colour
    nm   emission wavelength; None: not stated
    dye  name of the dye; empty: not stated

    None: the file states none of them.
    """
    return color_of_light(nm, dye) if rgb is None or not any(rgb) else linear_color(rgb)


def color_of_light(nm: float | str | None, dye: str = "") -> Color | None:
    """Return the colour (linear RGB) of a wavelength in nm, or of a dye; None: neither is known."""
    try:
        found = None if nm is None else color_of_wavelength(float(nm))
    except ValueError:
        found = None
    return color_of_name(dye) if found is None else found
