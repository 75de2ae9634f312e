"""How sure the identified parameters are: posterior, intervals, profile curves."""
