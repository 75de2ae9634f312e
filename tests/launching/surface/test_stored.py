"""Stored policies: what they say, and the message to a user who lacks one."""

from types import SimpleNamespace

import numpy as np
import pytest
from torch import nn

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import write_json
from sling2sim2real.launching.surface.stored import Stored
from sling2sim2real.policy.export import write_onnx
from sling2sim2real.policy.train import Policy
from tests.policy.linear import write_policy

BOX = SimpleNamespace(low=[-0.45, -0.30], high=[-0.25, -0.10])
TARGETS = np.array([1.5, 1.9])
ERRORS = {"mean_error_m": 0.004, "max_error_m": None}
CARD = {
    "training": {**ERRORS, "converged": True},
}


def stored(root) -> Stored:
    return Stored(root / "policy")


def write(policy: Stored, draw: tuple[float, float]) -> None:
    write_policy(policy.folder / "policy.onnx", (0, 0), draw)
    write_json(policy.folder / "card.json", CARD)


def refusal(read, *given) -> str:
    with pytest.raises(UserError) as error:
        read(*given)
    assert "\n" not in str(error.value)
    return str(error.value)


def test_a_policy_says_its_draws_and_its_card(tmp_path) -> None:
    policy = stored(tmp_path)
    write(policy, (-0.3, -0.1))
    np.testing.assert_allclose(policy.draws(TARGETS), [[-0.3, -0.1]] * 2)
    assert policy.card() == CARD | {"projectile": None, "made_with": None}


def test_a_damaged_policy_is_one_line(tmp_path) -> None:
    policy = stored(tmp_path)
    write(policy, (-0.3, -0.1))
    file, card = policy.folder / "policy.onnx", policy.folder / "card.json"
    whole = file.read_bytes()
    for damaged in (whole[: len(whole) // 2], b"not a network" * 20, b""):
        file.write_bytes(damaged)
        assert refusal(policy.draws, TARGETS) == f"{file}: damaged"
    for damaged in (b"{", b"\xff"):
        card.write_bytes(damaged)
        assert refusal(policy.card).startswith(f"{card}: cannot be read as JSON (")
    write_json(card, CARD | {"training": {}})
    assert refusal(policy.card) == f"{card}: training.converged: is missing"


def test_a_missing_policy_is_one_line(tmp_path) -> None:
    policy, folder = stored(tmp_path), tmp_path / "policy"
    assert refusal(policy.draws, TARGETS) == f"{folder / 'policy.onnx'}: missing"
    assert refusal(policy.card) == f"{folder / 'card.json'}: missing"


def test_a_card_without_the_start_of_the_projectile_is_one_line(tmp_path) -> None:
    """Of a policy that sees it."""
    policy = stored(tmp_path)
    write(policy, (-0.3, -0.1))
    seeing = Policy(nn.Sequential(nn.Linear(3, 2)), (1.4, 2.4), BOX, (0.0, -0.22))
    write_onnx(seeing, policy.folder / "policy.onnx")
    file = policy.folder / "card.json"
    assert refusal(policy.draws, TARGETS) == f"{file}: lacks the policy's input `projectile`"
    write_json(file, CARD | {"projectile": {"trained_at": [0.0, -0.22]}})
    np.testing.assert_allclose(policy.draws(TARGETS), seeing.draws(TARGETS), rtol=0, atol=1e-6)
    file.unlink()
    assert refusal(policy.draws, TARGETS) == f"{file}: missing"
