"""Who proposes parameters: the loop, its history, regions and optimisers."""
