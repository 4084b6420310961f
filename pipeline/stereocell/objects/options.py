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
        "aim of simplifying to lod0, lod1, ..., in finest spacings; at small objects less",
        bounds=Bounds(0, MAX_ERROR),
    )
    samples: int = setting(
        1000,
        "points of a tile at which distances are measured, each way",
        bounds=Bounds(1, MAX_SAMPLES),
    )
    smallest_voxels: int = setting(
        27, "objects of fewer voxels are left out, and counted", bounds=COUNT
    )
    background: int = setting(
        0,
        "number of the voxels that are no object, as 65535, 255 or -2 in some files; 0, -1 and NaN "
        "are none either",
        flag=Flag(
            "--background",
            "the number of the voxels of label maps that are no object, as 65535 or -2 in some "
            "files (0, -1 and NaN are none either)",
            "NUMBER",
        ),
        bounds=WHOLE_NUMBER,
    )
    table: str = setting(
        "",
        "a table with a row an object: CSV, TSV, Parquet, .h5ad, or a table of SpatialData",
        flag=Flag(
            "--table",
            "a table with a row an object, joined by --table-key: CSV, TSV, Parquet, .h5ad",
            "FILE",
        ),
    )
    table_key: str = setting(
        "",
        "the table's column of the objects' numbers; empty: CellID, label, Label, cell_id, ...",
        flag=Flag(
            "--table-key",
            "the table's column of the objects' numbers (default: CellID, label, cell_id, "
            "instance_id, object_id, whichever is there)",
            "COLUMN",
        ),
    )
    columns: tuple[str, ...] = setting(
        (),
        "columns of the table that are taken; empty: all, up to 128",
        flag=Flag("--columns", "columns of the table that are taken, as CD8,cell_type", "A,B,..."),
    )
    segment_labels: bool = setting(
        False,
        "whether segments of DICOM have their SegmentLabel for a name: free text, which may say "
        "who the patient is; else the standard's words for their codes",
        flag=Flag(
            "--segment-labels",
            "call segments of DICOM by their SegmentLabel, free text that may say who the patient "
            "is (default: the standard's words for their codes)",
        ),
    )
    color_by: str = setting(
        "",
        "the column that colours objects first; empty: the first of categories",
        flag=Flag("--color-by", "the column that colours objects first", "COLUMN"),
    )

    def __post_init__(self) -> None:
        if not self.errors or list(self.errors) != sorted(self.errors) or self.errors[0] <= 0:
            raise UsageError(
                f"objects.errors is {list(self.errors)}, expected rising positive numbers"
            )
        require_bounds("objects", self)
