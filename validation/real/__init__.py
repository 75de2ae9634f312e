"""The law `rubber` against measurements of real rubber that others made."""
