"""One rendered cell for all tests of certificates."""

from __future__ import annotations

import pytest

from tests.support.service.gauge_trials import PlateTrial, plate_trial


@pytest.fixture(scope="session")
def trial() -> PlateTrial:
    """A cell with a plate in its places."""
    return plate_trial(77)
