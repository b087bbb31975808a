"""The daemon and its commands: composes contour and drivers; holds paths, clocks, retries, states and log lines."""
