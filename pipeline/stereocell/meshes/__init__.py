"""Triangle meshes: simplification, exact validity, fairing, distances."""
