"""Steps of a build: each is computed once, and kept under a key of its inputs."""
