"""The formats of sources, one module or package each."""
