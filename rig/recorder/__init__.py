"""What the virtual rig writes of a pull-and-release: sensors, camera, MCAP."""
