"""The report: chapters, tables, figures, the page."""
