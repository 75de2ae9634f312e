"""Sling2Sim2Real: from one recording of an elastic band to a slingshot policy."""
