"""Identification from episodes: clamps, objective, search, optimisers, posterior, θ files."""
