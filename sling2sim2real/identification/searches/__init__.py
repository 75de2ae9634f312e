"""Searches of the unit cube, a file each: functions over `evaluate` (identification/search.py)."""
