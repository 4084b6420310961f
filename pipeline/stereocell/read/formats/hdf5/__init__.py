"""HDF5, netCDF-4, MATLAB 7.3 and EMD."""
