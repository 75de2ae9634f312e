"""The virtual rig, the hidden world: only recording, trials and the floor may know it."""
