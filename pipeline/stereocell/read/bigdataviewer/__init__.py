"""BigDataViewer's XML and containers, for the formats HDF5 and N5, which hold them."""
