"""The inbox: people upload specimens in a browser; the server reads, shows and builds them."""
