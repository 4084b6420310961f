"""Steps of a build: each runs once, and its result is kept under a key of its inputs."""
