"""OME-Zarr, and Zarr without its metadata."""
