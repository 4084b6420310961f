"""HDF5 files, opened safely, for the formats that are built on them."""
