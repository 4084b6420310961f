"""The viewer in a notebook: the page in a frame, fed by the kernel, without a server."""
