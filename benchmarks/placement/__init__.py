"""Parts laid into traced blocks, against a search over a million poses and against the true edge."""
