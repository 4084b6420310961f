"""BigDataViewer's XML and containers, for the formats that hold them: HDF5 and N5."""
