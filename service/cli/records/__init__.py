"""Commands that look at what was: `jobs`, `replay`."""
