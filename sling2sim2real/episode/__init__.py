"""The episode, real or simulated: its record, its filters, its phases."""
