"""Report of an identification: figures, tables, and one page that works offline."""

from identification.report.page import report_page

__all__ = ["report_page"]
