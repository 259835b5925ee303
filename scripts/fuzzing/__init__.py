"""The parts of `scripts/fuzz.py`: mutations, kinds of files, and processes that read what comes out."""
