"""Property tests are the same in every run, so that a red run means a changed program, and never timed.

`pytest --hypothesis-profile=explore` looks for new examples instead.

Of the hundreds of processes that tests start, each may leave its bytecode for the next, and has one thread for numpy's
algebra: its others wait busily while it starts.

Every test fails that leaves a descriptor or a thread open, or a task in its event loop.
"""

import os

from hypothesis import settings

from tests.support.leaks import no_task_is_left, nothing_is_left, pytest_collection_modifyitems

__all__ = ["no_task_is_left", "nothing_is_left", "pytest_collection_modifyitems"]

os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Those need a kernel with the virtual camera: `make test-camera` boots one and says so.
collect_ignore = [] if os.environ.get("COMBTRACE_CAMERA_GUEST") else ["camera_guest"]
# Those run a CNC controller for a minute: `make test-linuxcnc`.
collect_ignore += [] if os.environ.get("COMBTRACE_LINUXCNC") else ["linuxcnc"]

settings.register_profile("same", deadline=None, derandomize=True)
settings.register_profile("explore", deadline=None, max_examples=1000)
settings.load_profile("same")
