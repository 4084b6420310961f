"""Nouns: frozen dataclasses that every package speaks in. No file, no algorithm."""
