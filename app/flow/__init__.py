"""The stale stages in parallel, as a Prefect flow: DVC decides what is stale and owns the cache."""
