"""The command line `sling`, and what stands behind it."""
