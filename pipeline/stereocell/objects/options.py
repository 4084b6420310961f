"""Settings of objects."""

from dataclasses import dataclass

from stereocell.meshes.options import MAX_ERROR, MAX_SAMPLES
from stereocell.model.errors import UsageError
from stereocell.model.settings import COUNT, WHOLE_NUMBER, Bounds, Flag, require_bounds, setting


@dataclass(frozen=True, slots=True)
class ObjectOptions:
    """How the objects of label maps are built, and which table is joined to them.

    Raises UsageError unless the errors are positive and rise, and numbers are at least 1.
    """

    errors: tuple[float, ...] = setting(
        (0.1, 0.25, 0.6, 1.5),
        "largest errors of lod0, lod1, ... in finest spacings; small objects have smaller ones",
        bounds=Bounds(0, MAX_ERROR),
    )
    samples: int = setting(
        1000,
        "points of a tile for measuring distances, in each direction",
        bounds=Bounds(1, MAX_SAMPLES),
    )
    smallest_voxels: int = setting(
        27, "objects with fewer voxels are left out and counted", bounds=COUNT
    )
    background: int = setting(
        0,
        "number of the voxels outside all objects, such as 65535, 255 or -2 in some files; 0, -1 "
        "and NaN always count as outside",
        flag=Flag(
            "--background",
            "the number of voxels outside all objects, such as 65535 or -2 in some files (0, -1 "
            "and NaN always count as outside)",
            "NUMBER",
        ),
        bounds=WHOLE_NUMBER,
    )
    table: str = setting(
        "",
        "table with one row per object: CSV, TSV, Parquet, .h5ad, or a table of SpatialData",
        flag=Flag(
            "--table",
            "a table with one row per object, joined by --table-key: CSV, TSV, Parquet, .h5ad",
            "FILE",
        ),
    )
    table_key: str = setting(
        "",
        "column of the table with the objects' numbers; empty: CellID, label, Label, cell_id, ...",
        flag=Flag(
            "--table-key",
            "the table's column with the objects' numbers (default: the first of CellID, label, "
            "cell_id, instance_id, object_id, ObjectNumber, id that exists)",
            "COLUMN",
        ),
    )
    columns: tuple[str, ...] = setting(
        (),
        "columns of the table that are read; empty: all, up to 128",
        flag=Flag(
            "--columns", "columns of the table that are read, such as CD8,cell_type", "A,B,..."
        ),
    )
    segment_labels: bool = setting(
        False,
        "whether segments of DICOM are named by their SegmentLabel, free text that may identify "
        "the patient; otherwise by the standard's terms for their codes",
        flag=Flag(
            "--segment-labels",
            "name segments of DICOM by their SegmentLabel, free text that may identify the patient "
            "(default: the standard's terms for their codes)",
        ),
    )
    color_by: str = setting(
        "",
        "column that colours the objects at first; empty: the first column of categories",
        flag=Flag("--color-by", "the column that colours the objects at first", "COLUMN"),
    )

    def __post_init__(self) -> None:
        if not self.errors or list(self.errors) != sorted(self.errors) or self.errors[0] <= 0:
            raise UsageError(
                f"objects.errors is {list(self.errors)}, expected rising positive numbers"
            )
        require_bounds("objects", self)
