"""Tables in Parquet files."""

from importlib import import_module
from pathlib import Path

from shipgym.files import LARGEST_CSV, read_bytes
from shipgym.trials.readers.damage import check_unpacked, damage_reported
from shipgym.trials.readers.frames import read_frame
from shipgym.trials.readers.log_table import LogTable


def read_parquet(path: Path) -> LogTable:
    """Read a Parquet file; InputError for a damaged one, or one that unpacks to too much."""
    content = read_bytes(path, "Parquet file", LARGEST_CSV)
    with damage_reported(path, "Parquet", "it may be cut short: write it again"):
        arrow = import_module("pyarrow")
        parquet = import_module("pyarrow.parquet")
        file = parquet.ParquetFile(arrow.BufferReader(content))
        about = file.metadata
        groups = [about.row_group(k) for k in range(about.num_row_groups)]
        check_unpacked(path, sum(group.total_byte_size for group in groups))
        cells = about.num_rows * about.num_columns
        check_unpacked(path, 8 * cells)

        table = file.read()
        table.validate(full=True)  # offsets beyond the data
        return read_frame(table.to_pandas(), path, 1)
