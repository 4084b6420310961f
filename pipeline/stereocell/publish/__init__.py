"""Publish a bundle on a web host: in a folder, on object storage, or anywhere fsspec can write."""
