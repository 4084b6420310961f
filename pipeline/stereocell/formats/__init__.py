"""One codec for each file format. They know nothing of a build."""
