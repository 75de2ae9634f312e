"""How fast: simulator, recordings, methods, other engines."""
