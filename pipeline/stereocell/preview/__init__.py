"""Pictures of a source before a build."""
