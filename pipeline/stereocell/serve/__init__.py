"""The server: HTTP and websocket."""
