"""The web bundle, made from a composed stage."""
