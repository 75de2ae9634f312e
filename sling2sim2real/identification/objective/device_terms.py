"""The terms of a loss, computed where the rollouts are: a few numbers each come back from a GPU."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

import numpy as np

from sling2sim2real.identification.objective.chamfer import Chamfer
from sling2sim2real.simulator.interaction import Rollouts

if TYPE_CHECKING:
    import warp as wp
    from scipy.sparse import csr_array


class DeviceTerms:
    """The loss of one episode for rollouts that are Warp arrays."""

    def __init__(
        self,
        chamfer: Chamfer,
        *,
        force: np.ndarray,
        velocity: np.ndarray,
        window: int,
        sample_weights: np.ndarray,
        frame_weights: np.ndarray,
    ) -> None:
        """Keep what all rollouts share, and from its first use on a device a copy there.

        Args:
            force, velocity: The measured ones, smoothed [N], [m/s], shape (T, 3).
            window: Samples of the median filter, odd.
            sample_weights: What a sample adds to `force` for a newton, and to the signed `work` for
                a watt, shape (2, T).
            frame_weights: What a frame adds to `geom` for a metre, shape (K,).
        """
        self._chamfer, self._window = chamfer, window
        self._shared = {
            "measured": force,
            "velocity": velocity,
            "sample_weights": sample_weights,
            "frame_weights": frame_weights,
        }
        self._copies: dict[str, tuple[csr_array, dict[str, wp.array]]] = {}
        self._lock = threading.Lock()

    def __call__(self, rollouts: Rollouts, matrix: csr_array) -> np.ndarray:
        """Terms (N, 3) in the order of TERMS; 0 where no sample or frame has weight.

        Args:
            matrix: The recorded force's way, (T, S) from the rollouts' times.
        """
        import warp as wp

        from sling2sim2real.base.native import empty, run_kernel
        from sling2sim2real.identification.objective.kernel import terms_kernel

        line, force = rollouts.center_line, rollouts.force
        count, device = len(force), str(force.device)
        kernel, kind = terms_kernel(self._window)
        arrays = kind()
        for name, values in self._on(device, matrix).items():
            setattr(arrays, name, values)
        arrays.force, arrays.errors = force, self._chamfer.errors(line, device)
        arrays.samples, arrays.frames = len(matrix.indptr) - 1, self._chamfer.frames
        filtered = count * 3 * arrays.samples
        arrays.filtered = empty(filtered, wp.float64, device)
        arrays.terms = terms = empty(count * 3, wp.float64, device)
        run_kernel(kernel, count, [arrays], device)
        return terms.numpy().reshape(count, 3)

    def _on(self, device: str, matrix: csr_array) -> dict[str, wp.array]:
        """What all rollouts share, there; another filter replaces the last one."""
        import warp as wp

        with self._lock:
            shared, copies = self._copies.get(device, (None, {}))
            if shared is not matrix:
                rows = {"first": matrix.indptr, "columns": matrix.indices}
                values = {name: np.ravel(array) for name, array in self._shared.items()}
                values["values"] = matrix.data
                copies = {
                    name: wp.array(array.astype(np.int32), device=device)
                    for name, array in rows.items()
                } | {
                    name: wp.array(array.astype(float), device=device)
                    for name, array in values.items()
                }
                self._copies[device] = matrix, copies
            return copies
