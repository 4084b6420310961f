"""Data types that all packages share, mostly frozen dataclasses. No files and no algorithms."""
