"""Plan, units and phases: the only package that knows their order."""
