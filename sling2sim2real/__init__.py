"""Sling2Sim2Real for Python: from a recorded pull of an elastic band to aimed launches.

    import sling2sim2real as s2s

    band = s2s.Band(mass=0.0408, diameter=0.010, rest_length=0.52)
    episodes = s2s.read_mcap("my.mcap", band)            # or s2s.episode_from_arrays(...)
    identification = s2s.identify(episodes, band)        # θ, intervals, samples
    aimed = s2s.aim(identification, target=1.9)          # draw, prediction, 90 % interval
    seen = s2s.Observed(aimed.draw, error=1e-3, landing=1.84)   # you launched: it landed there
    identification = s2s.identify(episodes, band, start=identification, launches=[seen])

SI units throughout. Frame O: origin midway between the fork's tips, x along the fork, y towards the
target, z up. Nothing is read from or written to disk but by functions that take a path. Bad input
is a `UserError` of one line.
"""

import lazy_loader

__version__ = "0.2.0"

# What is there, and where: __init__.pyi. A module is imported when its first name is used.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
