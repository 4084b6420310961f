"""Codes of imaging modalities: defined terms of DICOM's Modality (0008,0060), PS3.3 C.7.3.1.1.1."""

_A_TO_I = (
    "AR AU BDUS BI BMD CFM CR CT DG DMS DX ECG EEG EMG EOG EPS ES FID GM HC HD IO IOL IVOCT IVUS"
)
_K_TO_P = "KER LEN LP LS M3D MG MR NM OAM OCT OP OPM OPT OPTBSV OPTENF OPV OSS OT PA PT PX"
_R_TO_Z = "RF RG RTDOSE RTIMAGE SM SRF SEG TG US VA XA XC"
SEGMENTATION = "SEG"  # code of channels that a command has derived from another image
TRACER_MODALITIES = ("PT", "NM")  # PET and SPECT, which measure the amount of a tracer
MODALITIES = frozenset(
    f"{_A_TO_I} {_K_TO_P} {_R_TO_Z}".split()
)  # codes of modalities that make images
