"""Pictures of a source, before anything is built."""
