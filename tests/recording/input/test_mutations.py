"""Damaged recordings, each an episode or one clear line; nothing passes silently."""

from __future__ import annotations

import pytest

from validation.campaigns.mutations import KINDS, campaign, counts, failures


@pytest.mark.slow
def test_the_first_sixty_mutations_of_each_kind(tmp_path) -> None:
    """Of those of the campaign."""
    results = campaign(tmp_path, [(0, 60, *KINDS)], 1)
    assert failures(results) == []
    assert len(results) == 60 * len(KINDS)
    # The damage was not all of one sort.
    for kind, found in counts(results).items():
        assert found["refused"] > 3 and found.get("said", 0) + found.get("silent", 0) > 15, kind
