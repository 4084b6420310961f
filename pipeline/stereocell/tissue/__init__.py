"""Tissue classes that are learned from a volume or found by a network."""
