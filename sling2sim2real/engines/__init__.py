"""Other engines that `engine:` and `sling export` may name, each an entry point."""
