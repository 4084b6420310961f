"""Check that HDF5's description of a number is that of a standard type.

HDF5 describes a number by its bits: the places of sign, exponent and mantissa, the exponent's bias,
and the bits in use. In most files no checksum protects the description, and HDF5 silently converts
numbers by any description.
"""

import h5py

from stereocell.model.errors import SourceError


def require_standard(stored: h5py.h5t.TypeID, where: str) -> None:
    """Raise SourceError for a number that is neither an IEEE float nor an integer of all bits."""
    if isinstance(stored, h5py.h5t.TypeEnumID):
        stored = stored.get_super()
    if not isinstance(stored, h5py.h5t.TypeFloatID | h5py.h5t.TypeIntegerID):
        return
    standard = h5py.h5t.py_create(stored.dtype)
    if not stored.equal(standard):
        raise SourceError(
            f"{where}: found {8 * stored.get_size()}-bit numbers of a layout of their own, "
            "expected IEEE floats or integers that use all bits: copy the file again, or convert "
            "it with h5py"
        )
