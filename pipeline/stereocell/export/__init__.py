"""One file for other programs, made from the composed stage: `stereocell export OUT FILE`."""
