"""The kind of a DICOM frame: the part of a complex signal, the derivation, the contrast.

One series may hold the magnitude and the phase of the same slices, projections of them, or several
echoes. The kind separates them (split_kinds.py). Words for the user come from the tables here and
never from the file, whose texts may identify a patient.

References: DICOM PS3.3 C.7.6.1.1.2 (Image Type), C.8.3.1.1.1 (MR), C.8.13.3.1 (Complex Image
Component), C.8.16.2.1.3 (Volume Based Calculation Technique), C.8.15.3 (CT).
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from stereocell.read.formats.dicom.header_values import (
    find_number,
    find_text,
    find_texts,
    find_value,
    find_words,
    private_number,
    private_tags,
)
from stereocell.read.formats.dicom.pet_kind import (
    NOT_CORRECTED,
    PET_TAGS,
    is_attenuation_corrected,
    is_reprojection,
    time_slice,
)
from stereocell.read.formats.dicom.silence_logs import DICOM_FAULTS

MAGNITUDE, PHASE, REAL, IMAGINARY = "magnitude", "phase", "real part", "imaginary part"
LOCALIZER = "localizer"
# words of ImageType and of ComplexImageComponent -> part of MR's complex signal
_COMPONENTS = {
    **dict.fromkeys(("M", "MAGNITUDE", "MODULUS"), MAGNITUDE),
    **dict.fromkeys(("P", "PHASE", "PHASE MAP", "VELOCITY MAP"), PHASE),
    **dict.fromkeys(("R", "REAL"), REAL),
    **dict.fromkeys(("I", "IMAGINARY"), IMAGINARY),
}
_PHILIPS = re.compile(r"([MPRI])_[A-Z0-9]+")  # Philips's words, such as `M_FFE` or `R_IR`
_GE = (MAGNITUDE, PHASE, REAL, IMAGINARY)  # indexed by the number in GE's private element
# role -> rank: an image (0) is shown first, a screen save last
_RANKS = {
    "": 0,
    "reformatted": 1,
    "subtraction": 1,
    "trace of diffusion": 1,
    "parametric map": 2,
    "projection": 3,
    "maximum intensity projection": 3,
    "minimum intensity projection": 3,
    "average of a slab": 3,
    LOCALIZER: 4,
    "rendering": 5,
    "screen save": 5,
    "dose or protocol sheet": 5,
}
# part of a complex image -> rank; a magnitude has 0
_PART_RANKS = {REAL: 2, IMAGINARY: 3, PHASE: 3}
_UNCORRECTED_RANK = 2  # rank of PET without attenuation correction
# patterns of words in ImageType -> role; the first match counts
_ROLES: tuple[tuple[re.Pattern[str], str], ...] = tuple(
    (re.compile(pattern), role)
    for pattern, role in (
        (r"LOCALIZER|SCOUT|TOPOGRAM|SURVEY", LOCALIZER),
        (r"(.* )?(PROT|DOSE|DOSE[ _]?(INFO|REPORT)|CSA REPORT|PROTOCOL)", "dose or protocol sheet"),
        (r"SCREEN ?SAVE|SCREENSHOT|SCREEN ?CAPTURE", "screen save"),
        (r"(.* )?(VRT|SSD|3D RENDERING|VOLUME_RENDER|SURFACE_RENDER|RENDERED)", "rendering"),
        (r"(.* )?(MINIP|MIN_IP|MIN IP|MNIP)|MINIMUM", "minimum intensity projection"),
        (r"(.*[ _])?(MIP|MAX_IP)( .*|_.*)?|MAXIMUM", "maximum intensity projection"),
        (r"PROJECTION( IMAGE)?", "projection"),
        (r"(.* )?(MPR|CURVED_MPR|REFORMATTED|CSAPARALLEL|CPR)( .*)?", "reformatted"),
        (r"AVERAGE|AVE|MEAN", "average of a slab"),
        (r"(PHASE |MODULUS )?SUBTRACT(ION)?", "subtraction"),
        (r"TRACE.*|ISOTROPIC", "trace of diffusion"),
        (
            r"ADC.*|EADC|FA|DIFFUSION MAP|(T1|T2|T2\*|T2STAR|R2|R2\*|DENSITY) MAP|[TR][12]_?MAP"
            r"|CBF|CBV|RCBF|RCBV|MTT|TTP|TMAX|PERFUSION MAP|STD_DEVIATION|EFF_ATOMIC_NUM"
            r"|ELECTRON_DENSITY|MAT_(SPECIFIC|REMOVED|FRACTIONAL|VALUE_BASED)"
            r"|FF|PDFF|(FAT|WATER)_FRAC(TION)?|[TR]2_?STAR(_MAP)?",
            "parametric map",
        ),
    )
)
# words of ImageType that name a contrast
_CONTRASTS = {
    **dict.fromkeys(("W", "WATER"), "water"),
    **dict.fromkeys(("F", "FAT"), "fat"),
    **dict.fromkeys(("IN_PHASE", "INPHASE", "IP"), "in phase"),
    **dict.fromkeys(("OUT_PHASE", "OPP_PHASE", "OPPOSED_PHASE", "OP"), "opposed phase"),
    **dict.fromkeys(("UNI",), "uniform"),
    "INV1": "first inversion",
    "INV2": "second inversion",
    "VMI": "virtual monoenergetic",
    **dict.fromkeys(("SWI", "SWAN", "SWIP"), "susceptibility-weighted"),
}
# contrasts of gradient echoes that only the echo time reveals (echo_phase.py)
IN_PHASE, OPPOSED_PHASE = "in phase by its echo time", "opposed phase by its echo time"
# contrast -> rank; an image without such a word has 0. In-phase and uniform images look like
# conventional ones and come first. The others are computed from them, or show less.
_CONTRAST_RANKS = {
    "in phase": 0,
    IN_PHASE: 0,
    "uniform": 0,
    "water": 1,
    "virtual monoenergetic": 1,
    "second inversion": 1,
    "susceptibility-weighted": 1,
    "opposed phase": 2,
    OPPOSED_PHASE: 2,
    "first inversion": 2,
    "fat": 3,
    NOT_CORRECTED: 3,
}
_FRAME_TYPES = (
    "MRImageFrameTypeSequence",
    "CTImageFrameTypeSequence",
    "PETFrameTypeSequence",
    "XRay3DFrameTypeSequence",
)
_GE_PART = (0x0043, 0x2F, "GEMS_PARM", "SS")
# private b-values: group, element, creator, VR
_B_VALUES = (
    (0x0019, 0x0C, "SIEMENS MR HEADER", "IS"),
    (0x0043, 0x39, "GEMS_PARM", "IS"),
    (0x2001, 0x03, "PHILIPS IMAGING", "FL"),
    (0x0065, 0x09, "IMAGE PRIVATE HEADER", "FD"),
)
# Siemens's SequenceName, such as `ep_b1000#2`
_SEQUENCE_B = re.compile(r"[*]?ep_b(\d{1,5})(#.*|t)?")
_GE_B_STEP = 1_000_000_000  # GE adds a multiple of it to some b-values
KIND_TAGS: list[Any] = [
    "ImageType",
    "ComplexImageComponent",
    "VolumeBasedCalculationTechnique",
    "ConvolutionKernel",
    "KVP",
    "MonoenergeticEnergyEquivalent",
    "ContrastBolusAgent",
    "ContrastBolusAgentSequence",
    "DiffusionBValue",
    "SequenceName",
    "EchoTime",
    "EchoNumbers",
    "InversionTime",
    "FlipAngle",
    "RepetitionTime",
    "MagneticFieldStrength",
    "ScanningSequence",
    "EchoPulseSequence",
    "EchoPlanarPulseSequence",
    "AcquisitionNumber",
    "TemporalPositionIdentifier",
    "NominalPercentageOfCardiacPhase",
    "TriggerTime",
    "FrameReferenceTime",
    *PET_TAGS,
    *(tag for group, element, *_ in (_GE_PART, *_B_VALUES) for tag in private_tags(group, element)),
]


@dataclass(frozen=True, slots=True)
class FrameKind:
    """The properties by which the frames of one series are separated; None or empty: not stated.

    part             part of a complex signal: one of the names above
    role             a key of _RANKS; empty: an image as it was acquired
    contrasts        contrasts for the user: keys of _CONTRAST_RANKS
    image_type       ImageType, compared and never shown
    kernel           values of ConvolutionKernel (kernel_names.py)
    has_agent        whether a contrast agent is stated
    is_attenuation_corrected  whether PET is corrected for attenuation
    energy_kev       keV of a virtual monoenergetic image
    echo_time, repetition_time, inversion_time, trigger_time, reference_time  ms
    is_gradient_echo  whether MR is a gradient echo that is not echo-planar; None: not stated
    field_t          T; strength of the magnetic field
    temporal, cardiac, acquisition, time_slice  number of the time point, cardiac phase (%), number
                     of the acquisition, number of PET's volume
    """

    part: str = ""
    role: str = ""
    contrasts: tuple[str, ...] = ()
    image_type: tuple[str, ...] = ()
    kernel: tuple[str, ...] = ()
    has_agent: bool = False
    is_attenuation_corrected: bool | None = None
    kvp: float | None = None
    energy_kev: float | None = None
    b_value: float | None = None
    echo_time: float | None = None
    echo_number: float | None = None
    inversion_time: float | None = None
    flip_angle: float | None = None
    repetition_time: float | None = None
    is_gradient_echo: bool | None = None
    field_t: float | None = None
    acquisition: float | None = None
    temporal: float | None = None
    cardiac: float | None = None
    trigger_time: float | None = None
    reference_time: float | None = None
    time_slice: float | None = None

    @property
    def rank(self) -> int:
        """Order in which kinds are shown, lowest first; images and magnitudes have 0."""
        uncorrected = _UNCORRECTED_RANK * (self.is_attenuation_corrected is False)
        return max(
            _PART_RANKS.get(self.part, 0), _RANKS[self.role], int(self.is_derived), uncorrected
        )

    @property
    def is_derived(self) -> bool:
        """Whether ImageType states DERIVED and no contrast.

        Water and fat are computed from echoes, but are not lesser images.
        """
        is_named = any(word in _CONTRASTS.values() for word in self.contrasts)
        return self.image_type[:1] == ("DERIVED",) and not is_named

    @property
    def contrast_rank(self) -> int:
        """Order among equal `rank`: in phase, water, opposed phase, fat."""
        return min((_CONTRAST_RANKS[word] for word in self.contrasts), default=0)

    @property
    def part_is_angle(self) -> bool:
        """Whether the frame is the phase of a complex signal, and so not an intensity."""
        return self.part == PHASE

    @property
    def is_diffusion(self) -> bool:
        """Whether images at one place may be directions or b-values of diffusion."""
        return bool(self.b_value) or "DIFFUSION" in self.image_type

    @property
    def words(self) -> tuple[str, ...]:
        """The part and the role, for the user; empty for a plain image."""
        return tuple(word for word in (self.part, self.role) if word)


def kind_of(header: Any, groups: Sequence[Any]) -> FrameKind:
    """Return the kind of a frame.

    groups  the frame's functional groups and the shared ones, each a dataset or None
    """
    words = _image_type(header, groups)
    modality = str(header.get("Modality", "")).strip()
    is_mr = modality == "MR"
    is_corrected = is_attenuation_corrected(header, groups) if modality == "PT" else None
    contrasts = [_CONTRASTS[word] for word in words if word in _CONTRASTS]
    if is_corrected is False:
        contrasts.append(NOT_CORRECTED)

    def number(sequence: str, key: str) -> float | None:
        return find_number(header, groups, sequence, key)

    kernel = find_texts(header, groups, "CTReconstructionSequence", "ConvolutionKernel")
    cardiac = "CardiacSynchronizationSequence"
    return FrameKind(
        part=_part(header, groups, words) if is_mr else "",
        role=_role(header, groups, words),
        contrasts=tuple(dict.fromkeys(contrasts)),
        image_type=words,
        kernel=kernel,
        has_agent=bool(_has_agent(header, groups)),
        is_attenuation_corrected=is_corrected,
        kvp=number("CTXRayDetailsSequence", "KVP"),
        energy_kev=number("MultienergyCTCharacteristicsSequence", "MonoenergeticEnergyEquivalent"),
        b_value=_b_value(header, groups) if is_mr else None,
        echo_time=_first_of(
            number("MREchoSequence", "EffectiveEchoTime"), number("MREchoSequence", "EchoTime")
        ),
        echo_number=number("MREchoSequence", "EchoNumbers"),
        inversion_time=_first_of(
            number("MRModifierSequence", "InversionTimes"), number("", "InversionTime")
        ),
        flip_angle=number("MRTimingAndRelatedParametersSequence", "FlipAngle"),
        repetition_time=number("MRTimingAndRelatedParametersSequence", "RepetitionTime"),
        is_gradient_echo=_is_gradient_echo(header, groups) if is_mr else None,
        field_t=number("", "MagneticFieldStrength") if is_mr else None,
        acquisition=_first_of(
            number("FrameContentSequence", "FrameAcquisitionNumber"),
            number("", "AcquisitionNumber"),
        ),
        temporal=_first_of(
            number("FrameContentSequence", "TemporalPositionIndex"),
            number("", "TemporalPositionIdentifier"),
        ),
        cardiac=number(cardiac, "NominalPercentageOfCardiacPhase"),
        trigger_time=_first_of(
            number(cardiac, "NominalCardiacTriggerDelayTime"), number("", "TriggerTime")
        ),
        reference_time=_first_of(
            number("", "FrameReferenceTime"), number("FrameContentSequence", "FrameReferenceTime")
        ),
        time_slice=time_slice(header, groups) if modality == "PT" else None,
    )


def _first_of(*values: float | None) -> float | None:
    return next((value for value in values if value is not None), None)


def _image_type(header: Any, groups: Sequence[Any]) -> tuple[str, ...]:
    """Return the words of the frame's type, in capitals."""
    found: Any = None
    try:
        for sequence in _FRAME_TYPES:
            found = found or find_value({}, groups, sequence, "FrameType")
        if not found:
            return find_words(header, (), "ImageType")
        words = (found,) if isinstance(found, str) else tuple(found)
        return tuple(str(word).strip().upper() for word in words)
    except DICOM_FAULTS:
        return ()


def _part(header: Any, groups: Sequence[Any], words: Sequence[str]) -> str:
    """Return the part of the complex signal: from the standard's attribute, ImageType or GE's."""
    stated = [
        find_text(header, groups, sequence, "ComplexImageComponent").upper()
        for sequence in ("MRImageFrameTypeSequence", "")
    ]
    for word in (*stated, *words[2:]):
        if word in _COMPONENTS:
            return _COMPONENTS[word]
    for word in words[2:]:
        philips = _PHILIPS.fullmatch(word)
        if philips:
            return _COMPONENTS[philips[1]]
    code = private_number(header, *_GE_PART)
    return _GE[int(code)] if code is not None and code in range(len(_GE)) else ""


def _role(header: Any, groups: Sequence[Any], words: Sequence[str]) -> str:
    if is_reprojection(header, groups):
        return "projection"
    stated = [
        find_text(header, groups, sequence, "VolumeBasedCalculationTechnique").upper()
        for sequence in (*_FRAME_TYPES, "")
    ]
    for pattern, role in _ROLES:
        if any(pattern.fullmatch(word) for word in (*stated, *words[2:])):
            return role
    return ""


def _has_agent(header: Any, groups: Sequence[Any]) -> bool:
    """Return whether a contrast agent is stated. Its name is free text and never shown."""
    try:
        usage = find_value(
            {}, groups, "ContrastBolusUsageSequence", "ContrastBolusAgentAdministered"
        )
        if usage is not None:
            return str(usage).strip().upper() == "YES"
        agent = str(header.get("ContrastBolusAgent") or "").strip().upper()
        return bool(agent) and agent not in ("NONE", "NO", "WITHOUT", "N/A")
    except DICOM_FAULTS:
        return False


def _is_gradient_echo(header: Any, groups: Sequence[Any]) -> bool | None:
    """Return whether the sequence is a gradient echo that is not echo-planar; None: not stated."""
    codes = find_words(header, groups, "ScanningSequence")
    pulse = find_text(header, groups, "", "EchoPulseSequence").upper()
    planar = find_text(header, groups, "", "EchoPlanarPulseSequence").upper()
    if not codes and not pulse:
        return None
    is_gradient = pulse == "GRADIENT" or ("GR" in codes and "SE" not in codes)
    return is_gradient and "EP" not in codes and planar != "YES"


def _b_value(header: Any, groups: Sequence[Any]) -> float | None:
    found = find_number(header, groups, "MRDiffusionSequence", "DiffusionBValue")
    for private in _B_VALUES:
        if found is None:
            found = private_number(header, *private)
    if found is None:
        named = _SEQUENCE_B.fullmatch(find_text(header, groups, "", "SequenceName"))
        found = float(named[1]) if named else None
    return None if found is None else found % _GE_B_STEP
