"""Property tests are the same in every run, so that a red run means a changed program, and never timed.

`pytest --hypothesis-profile=explore` looks for new examples instead.
"""

from hypothesis import settings

settings.register_profile("same", deadline=None, derandomize=True)
settings.register_profile("explore", deadline=None, max_examples=1000)
settings.load_profile("same")
