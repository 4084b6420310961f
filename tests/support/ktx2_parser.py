"""A KTX2 parser that is independent of the product, written from the specification."""

import struct


def parse(data):
    """Parse a KTX2 file by the tables of the KTX 2.0 specification, sections 3 and 5."""
    assert data[:12] == bytes([0xAB, 0x4B, 0x54, 0x58, 0x20, 0x32, 0x30, 0xBB, 0xD, 0xA, 0x1A, 0xA])
    names = ["format", "type_size", "width", "height", "depth"]
    names += ["layers", "faces", "levels", "scheme"]
    header = dict(zip(names, struct.unpack_from("<9I", data, 12), strict=True))
    dfd_at, dfd_length, kvd_at, kvd_length, sgd_at, sgd_length = struct.unpack_from(
        "<4I2Q", data, 48
    )
    assert (sgd_at, sgd_length) == (0, 0)
    index = [struct.unpack_from("<3Q", data, 80 + 24 * k) for k in range(header["levels"])]
    return header, index, data[dfd_at : dfd_at + dfd_length], data[kvd_at : kvd_at + kvd_length]
