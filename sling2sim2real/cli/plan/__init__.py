"""The pull that a robot is to record: trajectory, limits, files."""
