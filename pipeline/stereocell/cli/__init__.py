"""The command `stereocell`. Only this package prints answers."""
