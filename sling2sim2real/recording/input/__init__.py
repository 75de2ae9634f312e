"""Read an MCAP file's bytes as a `Recording`: any schema, checked, on one clock."""
