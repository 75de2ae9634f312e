"""Stages in parallel, by Prefect; DVC alone says what is stale, runs stages and keeps results."""
