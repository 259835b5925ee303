"""Report of an identification: figures, tables, and one page that works offline."""
