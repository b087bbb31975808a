"""Programs that measure, and that write what they measured into docs/. They take of tests only tests.support.

A room a subject, its tests beside it; nothing imports a room from outside.
"""
