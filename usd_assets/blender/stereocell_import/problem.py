"""The error that users see when a stage can't be imported or exported."""


class StageProblem(Exception):
    """A stage can't be imported or exported; the message is one line for Blender's status bar."""
