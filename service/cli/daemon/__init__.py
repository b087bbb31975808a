"""Commands that run the daemon, or speak with one that runs."""
