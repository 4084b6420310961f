"""Tissue classes that are learned from a volume."""
