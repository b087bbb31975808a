"""Acceptance tests of rendered cells, good ones and spoilt ones: whether certificates hold and faults are found."""
