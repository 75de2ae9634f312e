"""Other engines simulate the same band: to check ours against, and to compare speeds with."""
