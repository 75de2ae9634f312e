"""What people call: the command line and what stands behind it."""

__version__ = "0.2.0"
