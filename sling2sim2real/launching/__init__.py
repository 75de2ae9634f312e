"""Where launches land, and how to aim them."""
