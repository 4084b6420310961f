"""Passes and phases on OUT. Only this package knows their order."""
