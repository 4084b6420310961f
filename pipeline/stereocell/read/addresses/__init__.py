"""Addresses that people copy from a browser, and the data behind them."""
