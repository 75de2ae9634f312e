"""Everything that a search evaluated, one row a parameter vector, and the best of it.

Columns: method, phase (de, cma, bo, ...), generation, solver (null unless several run side by
side), unit_<name> and <name> (physical) of each axis, geom, force, work, total, failure. A failed
row has total = +inf, NaN terms and the reason.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import column, read_table, replacing
from sling2sim2real.settings.identification import POSTERIOR

if TYPE_CHECKING:
    from sling2sim2real.identification.objective.evaluate import Evaluation
    from sling2sim2real.simulator.parameters import Parameters

TERMS = ("geom", "force", "work")  # of the paper's loss
UNIT = "unit_"  # before the name of an axis: its coordinate in the unit cube


@dataclass
class Evaluations:
    """Rows in the order in which they were evaluated."""

    method: str
    names: tuple[str, ...]
    _parts: list[pa.Table] = field(default_factory=list)

    @property
    def _schema(self) -> pa.Schema:
        text, number, counter = pa.string(), pa.float64(), pa.int32()
        fields = {"method": text, "phase": text, "generation": counter, "solver": counter}
        axes = [UNIT + name for name in self.names] + [*self.names]
        fields |= dict.fromkeys((*axes, *TERMS, "total"), number)
        return pa.schema([*fields.items(), ("failure", text)])

    def add(
        self,
        evaluation: Evaluation,
        *,
        phase: str,
        generation: int,
        solver: np.ndarray | None = None,
    ) -> None:
        """Append a batch; `solver` says who asked for each point, shape (N,)."""
        count = len(evaluation.total)
        columns = {
            "method": [self.method] * count,
            "phase": [phase] * count,
            "generation": [generation] * count,
            "solver": [None] * count if solver is None else solver,
            **{UNIT + name: evaluation.unit[:, k] for k, name in enumerate(self.names)},
            **{name: evaluation.theta[:, k] for k, name in enumerate(self.names)},
            **evaluation.terms,
            "total": evaluation.total,
            "failure": evaluation.failure,
        }
        self._parts.append(pa.table(columns, schema=self._schema))

    @property
    def table(self) -> pa.Table:
        parts = self._parts or [self._schema.empty_table()]
        return pa.concat_tables(parts).combine_chunks()

    @property
    def unit(self) -> np.ndarray:
        """Shape (N, D)."""
        return np.stack([column(self.table, UNIT + name) for name in self.names], axis=1)

    @property
    def total(self) -> np.ndarray:
        """Shape (N,); +inf where failed."""
        return column(self.table, "total")

    def save(self, path: Path) -> None:
        with replacing(path) as temporary:
            pq.write_table(self.table, temporary)

    @classmethod
    def load(cls, method: str, *paths: Path) -> Evaluations:
        """Read files that `save` wrote, one after the other."""
        tables = [read_table(path) for path in paths]
        axes = (name for name in tables[0].column_names if name.startswith(UNIT))
        return cls(method, tuple(name.removeprefix(UNIT) for name in axes), tables)

    def followed_by(self, other: Evaluations) -> Evaluations:
        """These rows, then those of `other`."""
        return Evaluations(self.method, self.names, [self.table, other.table])

    def of_phase(self, phase: str) -> Evaluations:
        """The rows of one phase alone, by slices: a table's own filter imports pandas."""
        table = self.table
        rows = [row for row, name in enumerate(table["phase"].to_pylist()) if name == phase]
        parts = [table.slice(row, 1) for row in rows] or [table.slice(0, 0)]
        return Evaluations(self.method, self.names, parts)

    def best_parameters(self, law: str) -> Parameters:
        """One sample, of the best row. Raises UserError as `best_row`."""
        from sling2sim2real.simulator.parameters import Parameters  # not for who only reads rows

        best = self.best_row()
        return Parameters.named(law, {name: best[name] for name in self.names})

    def best_row(self) -> dict:
        """The row with the least total; among equals the first. Raises UserError if all failed."""
        total = self.total
        if not np.isfinite(total).any():
            reasons = sorted(set(self.table["failure"].to_pylist()))
            raise UserError(
                f"{self.method}: each of {len(total)} simulations failed ({'; '.join(reasons)});"
                " check the recording, and the box under `parameters` in params.yaml"
            )
        return self.table.slice(int(np.argmin(total)), 1).to_pylist()[0]


def theta_content(evaluations: Evaluations, band: str, entries: dict) -> dict:
    """What a θ file holds: the mode of a density where one was fitted, else the best evaluation.

    Args:
        evaluations: Everything that a search evaluated; a density's mode is a phase of its own.
        entries: What else the search says of θ (`PosteriorFile`).
    """
    mode = evaluations.of_phase(POSTERIOR)
    chosen = mode if len(mode.total) else evaluations
    best = chosen.best_row()
    terms = {name: best[name] for name in (*TERMS, "total") if np.isfinite(best[name])}
    return {
        "band": band,
        "method": chosen.method,
        "theta": {name: best[name] for name in chosen.names},
        "nuisances": {},
        "loss": terms,
        "rollouts": len(chosen.total),
        "failed": int(np.isinf(chosen.total).sum()),
        "found": {name: best[name] for name in ("phase", "generation", "solver")},
        "confidence": None,
        **entries,
    }
