"""Codecs, one for each file format. No codec depends on a build."""
