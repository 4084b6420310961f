"""The inbox: specimens that people hand in by a browser, understood, shown and built."""
