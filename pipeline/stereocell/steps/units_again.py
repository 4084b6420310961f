"""The remedy for a damaged result of the units' phase."""

AGAIN = "run `stereocell units OUT` again"
