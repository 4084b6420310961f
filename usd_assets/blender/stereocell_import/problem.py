"""What the user is told when a stage can't be imported or exported."""


class StageProblem(Exception):
    """One line for the status bar."""
