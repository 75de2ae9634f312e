"""Search for parameters: the loop, what it evaluated, regions and optimisers."""
