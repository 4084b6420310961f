"""Settings, and the plan that follows from them and the source."""
