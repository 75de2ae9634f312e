"""From the bytes of an MCAP file to a `Recording`: any schema, checked, on one clock."""
