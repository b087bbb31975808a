"""Everything that can be checked of a configuration and its machine, without disturbing a running service."""
