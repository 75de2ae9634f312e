"""What can be wrong with a recording: each check says what it compares, and how surely."""
