"""Differential evolution."""
