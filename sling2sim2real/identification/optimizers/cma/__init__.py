"""CMA-ES in several regions."""
