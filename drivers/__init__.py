"""Thin adapters to the outside: cameras, triggers, controllers. One attempt a call; policy is the service's."""
