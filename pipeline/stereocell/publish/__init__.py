"""Puts a bundle on a web host: a folder, object storage, whatever fsspec opens."""
