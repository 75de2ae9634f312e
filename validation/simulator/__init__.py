"""What `sling verify` holds the simulator against, figure by figure."""
