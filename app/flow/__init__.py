"""The stale stages in parallel, and what runs leave for Prefect's UI; DVC decides what is stale."""
