"""Other engines that `engine:` and `sling export` may name."""
