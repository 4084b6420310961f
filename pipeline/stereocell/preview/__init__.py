"""Draw pictures of a source before it is built."""
