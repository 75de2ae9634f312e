"""A calibrated band for other engines, matched to the calibrated simulation.

chain.py is the model that engines without our law can hold; match.py finds its parameters and
proves them by a replay in that engine; card.py says what came out and what is left.
"""

ENGINES = "mjcf", "newton", "usd"  # targets of an export
