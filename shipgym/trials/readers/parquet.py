"""Tables in Parquet files."""

from importlib import import_module
from pathlib import Path

from shipgym.files import LARGEST_CSV, read_bytes
from shipgym.trials.readers.damage import check_unpacked, damage_reported
from shipgym.trials.readers.frames import read_frame
from shipgym.trials.readers.log_table import LogTable


def read_parquet(path: Path) -> LogTable:
    """Read a Parquet file.

    Raises InputError for a damaged one, or one that unpacks to too much.
    """
    content = read_bytes(path, "Parquet file", LARGEST_CSV)
    with damage_reported(path, "Parquet", "it may be cut short: write it again"):
        arrow = import_module("pyarrow")
        parquet = import_module("pyarrow.parquet")
        file = parquet.ParquetFile(arrow.BufferReader(content))
        shape = file.metadata
        size = 0
        for k in range(shape.num_row_groups):
            size += shape.row_group(k).total_byte_size
        check_unpacked(path, max(size, 8 * shape.num_rows * shape.num_columns))

        table = file.read()
        table.validate(full=True)  # offsets beyond the data
        return read_frame(table.to_pandas(), path, first=1)
