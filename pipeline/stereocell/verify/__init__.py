"""Compare outputs with format rules, with the stage and with the source."""
