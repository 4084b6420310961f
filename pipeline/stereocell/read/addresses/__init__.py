"""Resolve addresses that people copy from a browser to the data behind them."""
