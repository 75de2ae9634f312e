"""Each public name has an example in its docstring, and the examples are so."""

import doctest
import importlib
import inspect
import pkgutil

import pytest

import sling2sim2real
from sling2sim2real import api
from sling2sim2real.episode.episode import Episode
from tests.project import ROOT

MODULES = [module.name for module in pkgutil.iter_modules(api.__path__)]
RESULTS = {
    "Aim",
    "Episode",
    "Exported",
    "Identification",
    "Interval",
    "Launch",
    "Simulation",
}  # of functions
INTERNAL = {"arguments", "band_folder", "identification"}  # modules without a public name
OTHERS = {"LaunchHistory", "Mounting", "Observed", "UserError"}  # the library's, passed on


@pytest.mark.parametrize("name", MODULES)
def test_examples_are_so(name: str) -> None:
    module = importlib.import_module(f"sling2sim2real.api.{name}")
    done = doctest.testmod(module, optionflags=doctest.ELLIPSIS)
    assert done.failed == 0 and (done.attempted > 3 or name in INTERNAL)


def test_every_public_name_has_a_docstring_and_every_function_an_example() -> None:
    for name in sling2sim2real.__all__:
        thing = getattr(sling2sim2real, name)
        assert inspect.getdoc(thing), name
        if name not in RESULTS | OTHERS:
            assert ">>> " in thing.__doc__, f"{name} has no example"
    assert sling2sim2real.Episode is Episode


def test_the_page_of_it_runs(tmp_path, monkeypatch, capsys) -> None:
    page = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    exec(page.split("```python\n")[1].split("```")[0], {})
    stiffness, aimed = capsys.readouterr().out.splitlines()
    assert float(stiffness.split()[0]) == pytest.approx(2.2e5, rel=0.1)
    assert "has not converged" not in aimed and (tmp_path / "my_band.json").exists()
