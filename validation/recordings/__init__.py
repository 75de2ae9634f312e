"""Recordings and pictures of a band whose truth is known; nothing of the rig.

`bag` writes a pull by formulas as MCAP; `foxglove_bag` and `small` write it again, in other schemas
and containers. `looks` renders pictures of its band in many looks, and scores clouds against it.
Episodes without a recording are in validation/synthetic.py.
"""
