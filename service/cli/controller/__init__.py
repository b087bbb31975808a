"""Commands on a controller, or in its place: `probe`, `register-map`, `simulate-controller`, `simulate-service`."""
