"""Show the viewer in a notebook: its page in a frame, with files from the kernel, not a server."""
