"""A source that is shown before it is built: a first view of coarse volumes."""
