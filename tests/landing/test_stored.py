"""Stored policies: which there are, what they say, and what a user is told who lacks one."""

import numpy as np
import pytest

from pipeline.base.errors import UserError
from pipeline.base.files import write_json
from pipeline.base.layout import NotMade
from pipeline.landing.stored import PLAIN, ROBUST, Stored
from tests.policy.linear import write_policy

TARGETS = np.array([1.5, 1.9])
ERRORS = {"mean_error_m": 0.004, "max_error_m": None}
CARD = {
    "training": {**ERRORS, "converged": True},
    "landing_map": dict.fromkeys(("box", "target_range"), {**ERRORS, "draws": 9}),
}


def stored(root, method: str = "none") -> Stored:
    return Stored("toy", method, root)


def write(one: Stored, kind: str, draw: tuple[float, float]) -> None:
    write_policy(one.folder(kind) / "policy.onnx", (0, 0), draw)
    write_json(one.folder(kind) / "card.json", CARD | {"kind": kind})


def refusal(read, *given) -> str:
    with pytest.raises(UserError) as error:
        read(*given)
    assert "\n" not in str(error.value)
    return str(error.value)


def test_each_policy_has_its_own_draws_and_card(tmp_path) -> None:
    one = stored(tmp_path)
    write(one, PLAIN, (-0.3, -0.1))
    assert one.kinds() == [PLAIN]
    write(one, ROBUST, (-0.4, -0.2))
    assert one.kinds() == [PLAIN, ROBUST]
    np.testing.assert_allclose(one.draws(TARGETS), [[-0.3, -0.1]] * 2)
    np.testing.assert_allclose(one.draws(TARGETS, ROBUST), [[-0.4, -0.2]] * 2)
    assert [one.card(kind) for kind in one.kinds()] == [
        CARD | {"kind": kind} for kind in one.kinds()
    ]


def test_a_damaged_policy_is_one_line(tmp_path) -> None:
    one = stored(tmp_path)
    write(one, PLAIN, (-0.3, -0.1))
    file, card = one.folder() / "policy.onnx", one.folder() / "card.json"
    whole = file.read_bytes()
    for damaged in (whole[: len(whole) // 2], b"not a network" * 20, b""):
        file.write_bytes(damaged)
        assert refusal(one.draws, TARGETS) == f"{file}: damaged"
    for damaged in (b"{", b"\xff"):
        card.write_bytes(damaged)
        assert refusal(one.card).startswith(f"{card}: cannot be read as JSON (")
    write_json(card, CARD | {"training": {}})
    assert refusal(one.card) == f"{card}: training.converged: is missing"


def test_a_missing_policy_says_what_it_hangs_on(tmp_path) -> None:
    """Also of a method that is called as the second policy's folder is."""
    for method in ("none", "robust"):
        one, folder = stored(tmp_path, method), tmp_path / "data/policies/toy" / method
        assert refusal(one.draws, TARGETS) == f"{folder / 'policy.onnx'}: missing"
        assert refusal(one.card) == f"{folder / 'card.json'}: missing"
        with pytest.raises(NotMade) as error:
            one.draws(TARGETS, ROBUST)
        assert error.value.path == folder / "robust" / "policy.onnx"
        assert error.value.condition.startswith("where policy.robust.methods")
        assert f"names {method} and" in error.value.condition
