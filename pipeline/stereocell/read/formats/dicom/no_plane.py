"""The error for a DICOM file without a usable plane, which is counted and left out."""


class NoPlaneError(Exception):
    """A file holds no usable plane; the text gives the reason without the file's values.

    remedy  what the file is, and what to name or export instead; empty: not known
    """

    remedy = ""
