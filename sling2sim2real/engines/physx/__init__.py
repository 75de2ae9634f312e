"""PhysX, the engine behind Isaac Sim and Isaac Lab: its deformable volumes as another engine.

It runs on a GPU alone, and in a process of its own: `worker.py`, by the interpreter that
SLING_PHYSX names, because ovphysx brings a USD of its own and asks for an old `packaging`.
"""
