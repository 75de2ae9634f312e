"""Optimisers behind ask and tell, a folder each."""
