"""Files and objects, whole or not at all: writes, locks, addresses, cache keys."""
