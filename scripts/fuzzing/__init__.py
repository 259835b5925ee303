"""The parts of `scripts/fuzz.py`: mutations, kinds of files, reading processes."""
