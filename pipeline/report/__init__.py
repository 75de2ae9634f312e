"""What people read: cards of bands, the report of a run, and how both are drawn."""
