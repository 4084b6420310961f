"""The tasks of workers. The key of a result holds the code of the one module that makes it."""
