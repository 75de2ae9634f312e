"""The chapters of the report, in its order."""
