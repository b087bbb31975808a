"""Medians, quantiles and distinct values, against numpy's own."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from contour.geometry.arrays import distinct, median, medians, quantile, quantiles

VALUES = arrays(st.sampled_from([np.uint8, np.int16, np.float32]), array_shapes(max_dims=2, max_side=9))


@given(VALUES.filter(lambda values: bool(np.isfinite(values).all())))
def test_medians_are_numpys(values: np.ndarray[tuple[int, ...], np.dtype[np.float32]]) -> None:
    exact = values.astype(np.float64)
    assert median(values) == np.median(exact)
    for axis in range(values.ndim):
        assert (medians(values, axis) == np.median(exact, axis=axis)).all()


@given(VALUES.filter(lambda values: bool((np.abs(values) < 1e6).all())), st.floats(0.0, 1.0))
def test_quantiles_are_numpys(values: np.ndarray[tuple[int, ...], np.dtype[np.float32]], share: float) -> None:
    exact = values.astype(np.float64)
    assert quantile(values, share) == pytest.approx(np.quantile(exact, share), rel=1e-9, abs=1e-9)
    shares = (share, 1.0 - share)
    assert quantiles(values, shares) == pytest.approx(np.quantile(exact, shares, axis=0), rel=1e-9, abs=1e-9)


@given(arrays(np.int64, array_shapes(max_dims=2, max_side=9), elements=st.integers(0, 20)))
def test_distinct_numbers_are_each_there_once_rising(numbers: np.ndarray[tuple[int, ...], np.dtype[np.int64]]) -> None:
    assert distinct(numbers).tolist() == np.unique(numbers).tolist()


def test_of_no_numbers_none_is_distinct() -> None:
    assert distinct(np.zeros(0, np.intp)).tolist() == []
