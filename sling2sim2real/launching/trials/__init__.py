"""Trials: launches as measured and as predicted, and where they may land."""
