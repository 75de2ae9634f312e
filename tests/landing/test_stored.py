"""Stored policies: which there are, what they say, and what a user is told who lacks one."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.base.errors import UserError
from pipeline.base.files import write_json
from pipeline.landing.stored import PLAIN, ROBUST, Stored
from tests.policy import toy
from tests.policy.linear import write_policy

TARGETS = np.array([1.5, 1.9])


def stored(root, method: str = "none") -> Stored:
    return Stored(toy.RUN, "toy", method, root)


def write(one: Stored, kind: str, draw: tuple[float, float]) -> None:
    write_policy(one.folder(kind) / "policy.onnx", (0, 0), draw)
    write_json(one.folder(kind) / "card.json", {"kind": kind})


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
    assert [one.card(kind) for kind in one.kinds()] == [{"kind": PLAIN}, {"kind": ROBUST}]


def test_a_damaged_policy_is_one_line(tmp_path) -> None:
    one = stored(tmp_path)
    write(one, PLAIN, (-0.3, -0.1))
    file, card = one.folder() / "policy.onnx", one.folder() / "card.json"
    whole = file.read_bytes()
    told = "damaged; `dvc repro --force policy@toy-none` makes it anew"
    for damaged in (whole[: len(whole) // 2], b"not a network" * 20, b""):
        file.write_bytes(damaged)
        assert refusal(one.draws, TARGETS) == f"{file}: {told}"
    for damaged in (b"{", b"\xff"):
        card.write_bytes(damaged)
        assert refusal(one.card) == f"{card}: {told}"


@pytest.mark.parametrize(
    ("method", "stage"),
    [
        ("none", "policy@toy-none"),
        ("without", "ablation_policy@toy-without"),
        ("robust", "policy@toy-robust"),
    ],
)
def test_says_which_stage_trains_the_policy(tmp_path, monkeypatch, method, stage) -> None:
    """Also of a method that is called as the second policy's folder is."""
    monkeypatch.setattr(toy.RUN, "methods", (*toy.RUN.methods, "robust"))
    one, makes = stored(tmp_path, method), f"missing; `dvc repro {stage}` makes it"
    folder = tmp_path / "data/policies/toy" / method
    assert refusal(one.draws, TARGETS) == f"{folder / 'policy.onnx'}: {makes}"
    assert refusal(one.card) == f"{folder / 'card.json'}: {makes}"
    robust = refusal(one.draws, TARGETS, ROBUST)
    assert robust.startswith(f"{folder / 'robust' / 'policy.onnx'}: {makes} where policy.robust.")
    assert f"names {method} and" in robust
    write_json(one.folder(ROBUST) / "card.json", {})
    (one.folder(ROBUST) / "policy.onnx").write_bytes(b"not a network")
    assert refusal(one.draws, TARGETS, ROBUST).endswith(
        f"damaged; `dvc repro --force {stage}` makes it anew"
    )
