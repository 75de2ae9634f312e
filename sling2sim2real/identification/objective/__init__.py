"""How far a simulated episode is from the recorded one: loss, parameter space, evaluation."""
