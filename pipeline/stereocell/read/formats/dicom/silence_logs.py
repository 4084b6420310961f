"""Silence pydicom and the codecs, whose messages on damaged files may quote their values."""

import logging
import struct
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

from pydicom import config as pydicom_config
from pydicom.errors import BytesLengthException, InvalidDicomError

# Errors of pydicom and its codecs on damaged files. Their texts may quote the values of tags.
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
    RuntimeError,  # includes NotImplementedError, and RecursionError (nested sequences)
    ArithmeticError,
    AssertionError,
    MemoryError,
    struct.error,
)


@contextmanager
def quiet() -> Iterator[None]:
    """Suppress all logs and warnings of pydicom and the codecs inside the block."""
    for name in ("pydicom", "pylibjpeg", "openjpeg", "highdicom"):
        logger = logging.getLogger(name)
        if logger.level <= logging.CRITICAL:  # setting a level empties the caches of all loggers
            logger.setLevel(logging.CRITICAL + 1)  # permanently, and for all loggers below
        logger.propagate = False
    mode = pydicom_config.settings.reading_validation_mode
    pydicom_config.settings.reading_validation_mode = pydicom_config.IGNORE
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        pydicom_config.settings.reading_validation_mode = mode
