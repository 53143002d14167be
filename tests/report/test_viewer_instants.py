"""Times of a recording are those of the log, to the nanosecond."""

import numpy as np
import pyarrow as pa

from shiplog.report.viewer import style


def test_the_instants_of_a_10_hz_log_are_whole_tenths():
    count = 100_000
    column = style.instants(0.1 * np.arange(count)).as_arrow_array().cast(pa.int64())
    np.testing.assert_array_equal(np.asarray(column), 100_000_000 * np.arange(count))
