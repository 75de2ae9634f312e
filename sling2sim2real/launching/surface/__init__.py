"""Where launches land: simulated maps, their response surface, stored policies."""
