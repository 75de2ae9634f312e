"""Adam with finite differences."""
