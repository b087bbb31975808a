"""Property tests are never timed: a busy machine is no reason to fail."""

from hypothesis import settings

settings.register_profile("untimed", deadline=None, max_examples=1500)
settings.load_profile("untimed")
