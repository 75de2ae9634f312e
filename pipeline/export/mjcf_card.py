"""How to use an exported model in MuJoCo: a chapter of its card."""

from __future__ import annotations

from pipeline.export.mjcf import VERSION


def how(name: str, step: float, finer: float, springs: float) -> str:
    """The chapter.

    Args:
        name: Of the XML file.
        step: Of time [s].
        finer: Largest relative change of landings with half of it.
        springs: Largest relative error of the springs' pull.
    """
    return f"""\
## Use

`{name}` needs nothing but MuJoCo {VERSION} or newer. This launches from the first of its drawn
states; run it in this folder:

```python
import mujoco
import numpy as np

model = mujoco.MjModel.from_xml_path("{name}")
data = mujoco.MjData(model)
hold, pouch = model.equality("hold").id, model.equality("pouch").id
ball = model.joint("projectile_x").dofadr[0] + np.arange(3)
floor = model.geom("floor").pos[2]

mujoco.mj_resetDataKeyframe(model, data, model.key("draw1").id)  # drawn, at rest
mujoco.mj_step(model, data)
print(f"hold force {{np.linalg.norm(data.sensordata[:3]):.2f}} N")
forward = -data.ctrl / np.linalg.norm(data.ctrl)  # from the draw to the fork
data.eq_active[hold] = 0  # the hand lets go
while data.body("projectile").xpos[2] > floor:
    mujoco.mj_step(model, data)
    if data.qfrc_constraint[ball] @ forward <= 0:
        data.eq_active[pouch] = 0  # the pouch pushes and never pulls
print(f"landing {{data.body('projectile').xpos[1]:.3f}} m")
```

- `data.ctrl` is where the arm is sent (x, y, z); it gives way as the lab's arm does. For a draw of
  your own, start from the key `hanging`, lead `ctrl` there, and wait until the band is at rest.
- `hold` ties the hand to the band's middle, `pouch` the projectile. To pull without a projectile,
  switch `pouch` off.
- The sensors `hold_force_x`, `_y`, `_z` are the drive's force: at rest, the band's on the hand.
- Nothing collides: floor and projectile are pictures. Give them `contype` and `conaffinity` if they
  are to.
- **Time step {1e3 * step:g} ms, integrator Euler.** The springs are explicit, so that no speed is
  lost. Half the step moves the proof's landings by {100 * finer:.2f} % at most. A larger one may
  not be stable.
- Each spring is two tendons of cubic pull, the second beyond a knee. Together they are within
  {100 * springs:.1f} % of the pull below."""
