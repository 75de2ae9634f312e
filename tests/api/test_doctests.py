"""Each public name has an example in its docstring, and the examples are so."""

import doctest
import importlib
import pkgutil

import pytest

from sling2sim2real import api
from tests.project import ROOT

MODULES = [module.name for module in pkgutil.iter_modules(api.__path__)]
INTERNAL = {"arguments", "band_folder", "identification"}  # modules without a public name


@pytest.mark.parametrize("name", MODULES)
def test_examples_are_so(name: str) -> None:
    module = importlib.import_module(f"sling2sim2real.api.{name}")
    done = doctest.testmod(module, optionflags=doctest.ELLIPSIS)
    assert done.failed == 0 and (done.attempted > 3 or name in INTERNAL)


def test_the_page_of_it_runs(tmp_path, monkeypatch, capsys) -> None:
    page = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    exec(page.split("```python\n")[1].split("```")[0], {})
    stiffness, aimed = capsys.readouterr().out.splitlines()
    assert float(stiffness.split()[0]) == pytest.approx(2.2e5, rel=0.1)
    assert "has not converged" not in aimed and (tmp_path / "my_band.json").exists()
