"""The oracle: a policy that knows the world, to say how near any policy could land.

It is found by launches in that world itself, and feeds no method. Only world.py knows the rig.
"""
