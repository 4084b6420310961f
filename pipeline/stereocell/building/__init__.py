"""Plan, units and phases. Only this package knows their order."""
