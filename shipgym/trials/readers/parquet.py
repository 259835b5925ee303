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
        metadata = file.metadata
        as_numbers = 8 * metadata.num_rows * metadata.num_columns
        as_declared = 0
        for k in range(metadata.num_row_groups):
            group = metadata.row_group(k)
            as_declared += group.total_byte_size
        check_unpacked(path, max(as_declared, as_numbers))

        table = file.read()
        table.validate(full=True)  # offsets beyond the data
        return read_frame(table.to_pandas(), path, first=1)
