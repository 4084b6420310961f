"""Run the passes and phases of a build on OUT. Only this package knows their order."""
