"""One band as a card: can it be trusted, its values, three draws, pictures, what would help."""
