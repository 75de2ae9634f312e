"""Tests take the parameters as delivered, whatever a user has set."""

import subprocess

import pytest
from ruamel.yaml import YAML

from pipeline.params import load
from tests.project import DEFAULTS, ROOT

CODE = "pipeline", "tests", "validation"  # who works with the project alone changes none of it


def git(*arguments: str) -> str:
    done = subprocess.run(["git", "-C", str(ROOT), *arguments], capture_output=True, text=True)
    if done.returncode:
        pytest.skip("no Git repository")
    return done.stdout


def test_they_are_the_defaults_of_the_project() -> None:
    """Who changes a default changes both files; held at the latest commit of code.

    A project whose bands are its users' has a params.yaml of its own.
    """
    commit = git("log", "-1", "--format=%H", "--", *CODE).strip()
    text = git("show", f"{commit}:params.yaml")
    if YAML(typ="safe").load(text)["bands"].keys() != load(DEFAULTS).bands.keys():
        pytest.skip("params.yaml is a user's")
    assert git("show", f"{commit}:validation/params.yaml") == text, "cp params.yaml validation/"


@pytest.mark.parametrize("name", ["params.yaml", "sling2sim2real/params.yaml"])
def test_no_test_reads_what_a_user_sets(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(AssertionError, match="tests take DEFAULTS"):
        load(ROOT / name)
    monkeypatch.chdir((ROOT / name).parent)
    with pytest.raises(AssertionError, match="tests take DEFAULTS"):
        load()
