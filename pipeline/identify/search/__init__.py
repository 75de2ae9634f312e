"""Search for parameters: the loop, its history, regions and optimisers."""
