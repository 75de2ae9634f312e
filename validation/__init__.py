"""Proof: the simulator held against truth, other engines, benchmarks, campaigns."""
