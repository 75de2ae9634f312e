"""One density of a band's parameters over all its recordings and launches: mode and intervals."""
