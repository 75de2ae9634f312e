"""Has `pipeline` be this project's, whatever else on the search path bears that name."""

import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

FILE = Path(__file__).parents[1] / "pipeline" / "__init__.py"


def load() -> None:
    """Import it by its place. Raises ImportError where another one is imported already."""
    loaded = sys.modules.get("pipeline")
    if loaded is not None:
        place = getattr(loaded, "__file__", None) or "a module"
        if place != str(FILE) and not (Path(place).exists() and FILE.samefile(place)):
            raise ImportError(
                f"{place} is called pipeline, as a package of sling2sim2real is: give it another"
                " name, or import sling2sim2real first"
            )
        return
    spec = spec_from_file_location("pipeline", FILE, submodule_search_locations=[str(FILE.parent)])
    assert spec and spec.loader
    sys.modules["pipeline"] = module = module_from_spec(spec)
    spec.loader.exec_module(module)


load()
