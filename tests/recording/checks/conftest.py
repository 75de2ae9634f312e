"""The recordings of tests/recording."""

from tests.recording.conftest import blind, checked, params, seen

__all__ = ["blind", "checked", "params", "seen"]
