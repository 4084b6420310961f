"""The title of a specimen, as a person gives it."""

MAX_TITLE = 120  # characters
