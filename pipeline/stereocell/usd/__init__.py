"""The USD stage: writers, readers of the composed stage, validation."""
