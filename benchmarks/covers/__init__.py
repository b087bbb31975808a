"""Covered edges: whether they are refused where they lie, and whether bridges are right."""
