"""Simulate jobs with PhysX: `python worker.py`, with nothing of this project.

Each line of standard input names a folder with scene.usda and job.npz (what bands.py writes); it
gets result.npz, and DONE is said. A stage's driven vertices cannot be freed again, so each phase
attaches the scene anew and goes on from the nodes' places and velocities at the end of the last.
A steered job's last phase goes on while there are targets: NEXT is said, with the nodes in
nodes.npy, and answered by a line, ON with the targets in targets.npy, or another that ends it.
"""

import os
import sys
from pathlib import Path

import numpy as np

DEVICE = "cuda:0"
DONE, NEXT, ON = "the job is done", "the next targets?", "on"
AS_WRITTEN = 2e-3  # m: attaching takes one step, in which a band falls by less


class Attached:
    """An attached scene of N bands of V vertices."""

    def __init__(self, physx, path: Path, number: int):
        import ovstage
        import warp as wp
        from ovphysx.types import TensorType

        self._physx, self._stage = physx, ovstage.Stage(f"phase {number}")
        ovstage.population.open_usd(
            self._stage, str(path), ordinal=1, domains=ovstage.PopulationDomain.ALL
        )
        self._stage.advance_write_floor(ordinal=1).wait()
        physx.wait_task(physx.attach_ovstage(self._stage, read_ordinal=1))
        physx.wait_all()
        self._views = [
            physx.create_tensor_binding(pattern="/World/B*", tensor_type=kind)
            for kind in (
                TensorType.DEFORMABLE_SIM_NODAL_POSITION,
                TensorType.DEFORMABLE_SIM_NODAL_VELOCITY,
                TensorType.DEFORMABLE_SIM_KINEMATIC_TARGET,
            )
        ]
        self._buffers = [
            wp.zeros(view.shape, dtype=wp.float32, device=DEVICE) for view in self._views
        ]
        self.state()  # takes the first step

    def state(self) -> list[np.ndarray]:
        """Places [m] and velocities [m/s] of the nodes, shape (N, V, 3) each."""
        for view, buffer in zip(self._views[:2], self._buffers[:2], strict=True):
            view.read(buffer)
        return [buffer.numpy().copy() for buffer in self._buffers[:2]]

    def write(self, which: int, values: np.ndarray) -> None:
        """Places (0), velocities (1) or targets with their flag, 0 for a driven node (2)."""
        self._buffers[which].assign(np.ascontiguousarray(values, np.float32))
        self._views[which].write(self._buffers[which])

    def close(self) -> None:
        for view in self._views:
            view.destroy()
        self._physx.wait_task(self._physx.detach_ovstage())
        self._stage.destroy()


def start():
    """PhysX, ready for scenes."""
    import ovphysx
    import ovstage
    import warp as wp
    from ovphysx import PhysX, PhysXConfig
    from ovphysx.samples.python_samples.schema_support import physx_schema_paths

    if not wp.is_cuda_available():
        sys.exit("deformable volumes need an NVIDIA GPU; there is none here")
    schemas = [*map(str, physx_schema_paths()), str(ovphysx.newton_schema_root())]
    ovstage.population.register_usd_schemas(schemas)
    return PhysX(config=PhysXConfig(carbonite_overrides={"/physics/suppressReadback": True}))


def requested(folder: Path, nodes: np.ndarray) -> np.ndarray | None:
    """Targets (N, D, 3) of the next step for nodes (N, V, 3) [m]; None: the phase is over."""
    np.save(folder / "nodes.npy", nodes.astype(np.float32))
    print(f"\n{NEXT}", flush=True)  # PhysX may not have ended its line
    on = sys.stdin.readline().strip() == ON
    return np.load(folder / "targets.npy") if on else None


def simulate(physx, folder: Path) -> None:
    """Simulate a job's phases one after the other."""
    job = dict(np.load(folder / "job.npz"))
    offset, step = job["offsets"][:, None], float(job["step"])
    place, velocity = job["start"] + offset, np.zeros_like(job["start"])
    result = {}
    for phase in range(int(job["phases"])):
        scene = Attached(physx, folder / "scene.usda", phase)
        expected = np.broadcast_to(job["rest"] + offset, place.shape)
        if np.abs(scene.state()[0] - expected).max() > AS_WRITTEN:
            sys.exit("PhysX has other nodes than the scene, or in another order")
        for which, values in enumerate((place, velocity)):
            scene.write(which, values)
        vertices, targets, fade, keep = (
            job[f"{name}_{phase}"] for name in ("vertices", "targets", "fade", "keep")
        )
        flags = np.ones((*place.shape[:2], 1))
        flags[:, vertices] = 0.0
        drive = np.concatenate([place, flags], axis=2, dtype=np.float32)
        begin = place[:, vertices] - offset - targets[0]
        targets = np.broadcast_to(targets, (len(fade), *targets.shape[1:]))
        retained = []
        for target, share in zip(targets, fade, strict=True):
            drive[:, vertices, :3] = offset + target + share * begin
            scene.write(2, drive)
            physx.step_sync(step)
            if keep:
                retained.append((scene.state()[0] - offset).astype(np.float32))
        while job["steered"] and phase + 1 == job["phases"]:
            targets = requested(folder, scene.state()[0] - offset)
            if targets is None:
                break
            drive[:, vertices, :3] = offset + targets
            scene.write(2, drive)
            physx.step_sync(step)
        place, velocity = scene.state()
        result[f"positions_{phase}"] = np.array(retained or np.zeros((0, *place.shape)), np.float32)
        scene.close()
    np.savez(folder / "result.npz", **result)


def main() -> None:
    """Jobs until there are no more."""
    engine = start()
    for line in iter(sys.stdin.readline, ""):
        simulate(engine, Path(line.strip()))
        print(f"\n{DONE}", flush=True)
    os._exit(0)  # PhysX's own end can hang


if __name__ == "__main__":
    main()
