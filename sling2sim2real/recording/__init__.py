"""Build an episode from a recording."""
