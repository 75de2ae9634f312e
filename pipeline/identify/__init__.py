"""From episodes to parameters: clamps, objective, search, optimisers, posterior, and θ files."""
