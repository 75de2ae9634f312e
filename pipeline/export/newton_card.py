"""How to use an exported band in Newton: a chapter of its card."""

from __future__ import annotations


def how(name: str, edges: int, step: float, finer: float) -> str:
    """The chapter.

    Args:
        name: Of the JSON file.
        edges: Springs.
        step: Of time [s].
        finer: Largest relative change of landings with half of it.
    """
    return f"""\
## Use

`{name}` has the numbers, `newton_band.py` builds the band from them. They need numpy, Warp and
Newton 1.8, nothing else. This launches the draws of the proof, all at once; run it in this folder:

```python
from newton_band import SpringBands

bands = SpringBands("{name}", count=3, device="cpu")
forces = bands.draw(bands.numbers["draws_m"])  # held at rest
landings, _ = bands.launch()
for force, landing in zip(forces, landings):
    print(f"hold force {{force:.2f}} N")
    print(f"landing {{landing:.3f}} m")
```

- `draw` takes places (y, z) to which the arm is sent, one of each band; it gives way as the lab's
  arm does. `lead` sends it elsewhere, `run` advances, `lines` and `force` say where the nodes are
  and what acts on the hand.
- `bands.model` and `bands.states` are Newton's: particles 0 to {edges} are the nodes, the last is
  the projectile. While it is in the pouch the middle node has its mass.
- Newton's own springs are linear, and push when they are short. So a Warp kernel adds the pull
  below to `State.particle_f`, and **SolverSemiImplicit** advances the particles. In a scene of your
  own, copy the kernels `forces` and `carry` around its step. No other solver was tried.
- Nothing collides.
- **Time step {1e3 * step:g} ms.** The springs are explicit, so that no speed is lost. Half the step
  moves the proof's landings by {100 * finer:.2f} % at most. A larger one may not be stable.
- It was run on the CPU only. `device="cuda:0"` is taken, and was not tried."""
