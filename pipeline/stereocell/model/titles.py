"""The title that a user gives a specimen."""

MAX_TITLE = 120  # characters of the longest title
