"""Endings of the image files of planes, in lower case."""

TIFF = (".tif", ".tiff", ".stk", ".lsm")
PNG = (".png",)
JPEG = (".jpg", ".jpeg")
BMP = (".bmp",)
