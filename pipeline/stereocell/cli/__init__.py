"""The command `stereocell`: the only package that prints."""
