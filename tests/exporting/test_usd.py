"""PhysX's USD: valid by usd-core and by PhysX's own schemas; its law on paper."""

import json
from collections import Counter

import numpy as np
import pytest

from sling2sim2real import export
from sling2sim2real.exporting import usd
from sling2sim2real.exporting.match import DrawCompared
from sling2sim2real.exporting.mesh import Tube
from sling2sim2real.exporting.usd import ON_PAPER, nominal
from sling2sim2real.simulator.cylinder import volumes
from tests.project import ROOT


@pytest.fixture(scope="module")
def done(model, tmp_path_factory):
    """As without PhysX, wherever the test runs."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sling2sim2real.engines.physx.match.matched", lambda model, band: None)
        return export(model, "usd", tmp_path_factory.mktemp("exports") / "toy")


def test_its_law_is_hookes_when_small_and_stiffer_than_rubber_when_large() -> None:
    small = np.array([1.0, 1.001])
    assert nominal(small, 0.45) == pytest.approx([0, 1e-3], rel=2e-3)
    large, incompressible = np.array([1.5, 2.0]), 0.499
    rubber = (large - large**-2) / 3
    assert (nominal(large, incompressible) > 1.1 * rubber).all()


def test_the_surface_is_closed_and_seen_from_outside(model) -> None:
    tube = Tube.of(model.sling, usd.EDGES, usd.GRADING)
    faces = usd.surface(tube.tetrahedra)
    edges = Counter(
        edge for face in faces.tolist() for edge in zip(face, [*face[1:], face[0]], strict=True)
    )
    assert set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)
    corners = tube.rest.reshape(-1, 3)[faces]
    volume = np.linalg.det(corners).sum() / 6  # positive where faces look outwards
    assert volume == pytest.approx(volumes(tube.rest, tube.tetrahedra).sum())


def test_it_says_that_nobody_has_run_it(done) -> None:
    assert done.met is None and done.card["replayed"] is False
    assert "**Match it before you rely on it.**" in (done.folder / "README.md").read_text()
    assert done.card["factor_on_youngs_modulus"] < 1  # its law is stiffer
    assert done.card["factor_on_mass"] == 1 and "proof" not in done.card
    errors = np.array(done.card["tension_errors"])
    assert errors.min() < 0 < errors.max() and np.abs(errors).max() < 0.25


def test_what_it_expects_of_itself_is_what_the_committed_study_saw(done) -> None:
    study = json.loads((ROOT / "reports/validation/export-usd.json").read_text("utf-8"))
    rows = [row for band in study["bands"].values() for row in band["on_paper"]]
    for name, (low, high) in ON_PAPER.items():
        errors = [row[f"{name}_error"] for row in rows]
        assert (round(min(errors), 2), round(max(errors), 2)) == (low, high)
    text = (done.folder / "README.md").read_text()
    assert f"landed {100 * ON_PAPER['landing'][0]:.0f} to" in " ".join(text.split())


def test_usd_and_the_schemas_of_physx_know_all_that_is_in_it(done) -> None:
    pytest.importorskip("pxr", reason="usd-core: pip install -e '.[export]'")
    pytest.importorskip("physx_usd_schemas", reason="pip install -e '.[export]'")
    import physx_usd_schemas
    from pxr import Usd, UsdGeom, UsdPhysics, UsdValidation

    physx_usd_schemas.register_all()
    stage = Usd.Stage.Open(str(done.folder / "toy.usda"))
    assert UsdGeom.GetStageMetersPerUnit(stage) == UsdPhysics.GetStageKilogramsPerUnit(stage) == 1
    errors = UsdValidation.ValidationContext(
        UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    ).Validate(stage)
    assert [error.GetMessage() for error in errors] == []
    for prim in stage.Traverse():
        defined = set(prim.GetPrimDefinition().GetPropertyNames())
        unknown = {
            GetAuthoredProperty.GetName() for GetAuthoredProperty in prim.GetAuthoredProperties()
        } - defined
        assert {name for name in unknown if not name.startswith(("xformOp", "material:"))} == set()
    band = UsdGeom.TetMesh(stage.GetPrimAtPath("/World/Band"))
    points, tets = (
        np.array(attribute.Get())
        for attribute in (band.GetPointsAttr(), band.GetTetVertexIndicesAttr())
    )
    corners = points[tets]
    assert (np.linalg.det(corners[:, 1:] - corners[:, :1]) > 0).all()
    rest = stage.GetPrimAtPath("/World/Band").GetAttribute("omniphysics:restShapePoints").Get()
    assert points == pytest.approx(np.array(rest))  # bent ones collapse in PhysX


def test_a_launch_that_is_lost_in_the_engine_is_a_gap_in_the_card(
    model, tmp_path, monkeypatch
) -> None:
    def match(model, band: usd.UsdBand) -> usd.UsdMatch:
        lost = DrawCompared((-0.3, -0.2), (8.0, 8.1), (4.0, np.nan), (2.0, np.nan))
        landed = DrawCompared((-0.3, -0.1), (6.0, 6.1), (4.0, 4.1), (1.0, 1.1))
        return usd.UsdMatch(band, [landed], [lost, landed], [landed], "an engine")

    monkeypatch.setattr("sling2sim2real.engines.physx.match.matched", match)
    done = export(model, "usd", tmp_path / "usd")
    assert done.met is False and done.card["proof"][0]["landing_error"] is None
    text = (done.folder / "README.md").read_text()
    assert "| +1.2 % | 2.000 m | does not land |" in text and "| 1.000 m | +10.0 % |" in text
    assert "not as near as asked" in text and "Match it before" not in text
    blocks = text.split("\n\n")
    assert any(block.startswith("`toy.usda` has the scene") for block in blocks)
