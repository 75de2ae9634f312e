"""From a recording to an episode."""
