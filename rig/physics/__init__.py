"""Rubber, string, robot and launches of the virtual rig."""
