"""Files of results: θ, its confidence, and how a band hangs."""
