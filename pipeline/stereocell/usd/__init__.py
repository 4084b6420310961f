"""The USD stage: written, and read back composed."""
