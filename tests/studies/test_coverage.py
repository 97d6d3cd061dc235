"""The study of coverage: its parts by hand."""

import numpy as np
import pytest
from scipy import stats

from studies.coverage import fieller, misses


def test_misses_by_hand():
    low, high = np.array([0.1, 0.2, 0.4, 0.3, 0.1]), np.array([0.2, 0.5, 0.6, 0.9, np.inf])
    assert misses((low, high), 0.3) == pytest.approx({"covered": 0.6, "too_low": 0.2, "too_high": 0.2, "open": 0.2})


def test_fieller_by_hand():
    ours, theirs = np.array([[2.0, 2.0, 2.0]]), np.array([[5.0, 8.0, 11.0]])
    low, high = fieller(ours, theirs, np.random.default_rng(0))
    reach = stats.t.ppf(0.975, 2) * np.sqrt(3)  # x is 8 ± √3, so that R lies in 2 / (8 ± t √3)
    assert (low[0], high[0]) == pytest.approx((2 / (8 + reach), 2 / (8 - reach)))
