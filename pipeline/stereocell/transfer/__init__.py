"""Histograms, thresholds, and transfer functions of one and two dimensions."""
