"""The three tissue classes of a head in T1-weighted MR: their names and colours."""

GREY_MATTER, WHITE_MATTER = "grey matter", "white matter"
# Names and colours (linear RGB), by rising T1 intensity
HEAD = (
    ("CSF", (0.03, 0.3, 1.0)),
    (GREY_MATTER, (1.0, 0.22, 0.1)),
    (WHITE_MATTER, (0.95, 0.85, 0.45)),
)
