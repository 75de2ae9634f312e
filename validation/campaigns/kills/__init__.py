"""Commands killed, and disks filled, at random moments: what comes out in the end is the same."""
