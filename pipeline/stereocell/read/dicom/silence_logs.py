"""What pydicom and codecs say about damaged files may quote their values: it is not passed on."""

import logging
import struct
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

from pydicom import config as pydicom_config
from pydicom.errors import BytesLengthException, InvalidDicomError

# What pydicom and its codecs raise on damaged files; their texts may quote the values of tags.
DICOM_FAULTS = (
    InvalidDicomError,
    BytesLengthException,
    OSError,
    EOFError,
    ValueError,
    TypeError,
    KeyError,
    IndexError,
    AttributeError,
    RuntimeError,  # NotImplementedError and RecursionError (nested sequences) too
    ArithmeticError,
    AssertionError,
    MemoryError,
    struct.error,
)


@contextmanager
def quiet() -> Iterator[None]:
    """Let nothing of what pydicom and the codecs say reach a log or a warning inside the block."""
    for name in ("pydicom", "pylibjpeg", "openjpeg", "highdicom"):
        logger = logging.getLogger(name)
        logger.setLevel(logging.CRITICAL + 1)  # for good, and for all loggers below
        logger.propagate = False
    mode = pydicom_config.settings.reading_validation_mode
    pydicom_config.settings.reading_validation_mode = pydicom_config.IGNORE
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        pydicom_config.settings.reading_validation_mode = mode
