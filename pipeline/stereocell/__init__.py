"""StereoCell."""
