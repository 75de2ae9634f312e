"""What people call: the command line and what stands behind it."""
