"""Run tasks on this machine or on a cluster."""
