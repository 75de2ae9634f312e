"""The paper's own results (Sling2Sim2Real, tables 1 to 4), measured by its authors on a robot.

They stand beside ours as what they are: another rubber, another rig and real launches.
"""

from __future__ import annotations

# Landing error [cm]: mean and deviation for g = 1.725, 1.925, 2.125 m and over all targets;
# None where the paper prints N/A.
LANDING = {
    ("Band 1", "Sling2Sim2Real"): ((11.0, 2.0), (1.0, 1.22), (9.5, 4.3), (7.17, 2.68)),
    ("Band 1", "Package SI"): ((13.0, 1.87), (1.5, 1.22), (9.5, 2.5), (8.0, 1.94)),
    ("Band 1", "Real2Sim2Real"): (None, None, None, None),
    ("Band 1", "DE"): ((19.0, 1.22), (11.5, 1.22), (3.0, 1.87), (11.17, 0.85)),
    ("Band 1", "BO"): ((16.5, 1.22), (3.0, 1.87), (8.0, 6.0), (9.17, 2.12)),
    ("Band 1", "Adam"): ((11.0, 2.0), (20.0, 3.16), (34.5, 5.79), (21.83, 2.31)),
    ("Band 1", "without covariance and multi-start"): (
        (15.0, 1.58),
        (6.0, 1.22),
        (0.5, 2.45),
        (7.83, 5.39),
    ),
    ("Band 1", "without multi-start"): ((29.5, 2.92), (15.0, 3.87), (16.5, 2.0), (20.33, 7.18)),
    ("Band 1", "without covariance"): ((22.5, 3.87), (1.0, 1.22), (6.5, 5.39), (10.0, 9.91)),
    ("Band 1", "without the work term"): ((33.0, 1.0), (30.0, 1.58), (20.5, 2.45), (27.83, 5.62)),
    ("Band 2", "Sling2Sim2Real"): ((15.5, 1.87), (3.5, 2.0), (23.5, 2.55), (14.17, 2.16)),
    ("Band 2", "Package SI"): ((60.0, 2.74), (34.5, 3.32), (11.0, 6.44), (35.17, 4.58)),
    ("Band 2", "Real2Sim2Real"): (None, None, None, None),
    ("Band 3", "Sling2Sim2Real"): ((35.5, 1.87), (18.0, 1.87), (3.5, 3.39), (19.0, 2.47)),
    ("Band 3", "Package SI"): (None, None, None, None),
    ("Band 3", "Real2Sim2Real"): (None, None, None, None),
}
TARGETS = (1.725, 1.925, 2.125)
REPEATS = 5  # launches a cell
BANDS = {"band1": "Band 1", "band2": "Band 2", "band3": "Band 3"}  # ours that imitate them
KINDS = {"Band 1": "soft", "Band 2": "medium", "Band 3": "stiff"}
METHODS = {  # ours that are theirs
    "sling2sim2real": "Sling2Sim2Real",
    "package_si": "Package SI",
    "real2sim2real": "Real2Sim2Real",
    "de": "DE",
    "bo": "BO",
    "adam": "Adam",
    "no_covariance": "without covariance",
    "no_multistart": "without multi-start",
    "no_covariance_no_multistart": "without covariance and multi-start",
    "no_work": "without the work term",
}
# Rows of its tables, in its order; the method itself comes last in each.
BENCHMARK = ("real2sim2real", "package_si", "sling2sim2real")  # tables 1 and 2
OPTIMISERS = ("de", "bo", "adam", "sling2sim2real")  # table 3
ABLATIONS = (  # table 4
    "no_covariance_no_multistart",
    "no_multistart",
    "no_covariance",
    "no_work",
    "sling2sim2real",
)

# Identified E [Pa], nu, damping [s], friction, damping scale, and the loss.
THETA = {
    ("Band 1", "Sling2Sim2Real"): (9.29e5, 0.46, 1.11e-2, 0.80, 0.79, 1.9785),
    ("Band 1", "Package SI"): (7.06e5, 0.45, 1.30e-2, 0.25, 1.00, 2.4718),
    ("Band 1", "Real2Sim2Real"): (8.52e6, 0.45, 5.12e-3, 0.94, 1.00, 4.1798),
    ("Band 2", "Sling2Sim2Real"): (5.01e6, 0.38, 1.01e-2, 0.28, 0.77, 2.1749),
    ("Band 2", "Package SI"): (2.23e6, 0.45, 9.38e-3, 0.25, 1.00, 2.3267),
    ("Band 2", "Real2Sim2Real"): (1.63e5, 0.45, 5.13e-3, 0.61, 1.00, 4.2244),
    ("Band 3", "Sling2Sim2Real"): (3.33e6, 0.40, 7.89e-3, 0.40, 0.71, 0.9416),
    ("Band 3", "Package SI"): (9.56e5, 0.45, 2.43e-2, 0.25, 1.00, 3.4290),
    ("Band 3", "Real2Sim2Real"): (1.27e5, 0.45, 5.13e-3, 0.98, 1.00, 3.7900),
}
