"""Folders of planes."""
