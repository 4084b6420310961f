"""The tasks of workers. A result's key covers the code of the one module that makes it."""
