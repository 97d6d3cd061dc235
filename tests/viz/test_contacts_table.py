"""The report's tables of what the robot did to the child, by rows made by hand."""

import pandas as pd

from caregiver_mj.recording.contacts import Contacts
from caregiver_mj.viz.report.tables import counts_table


def rows(*changes):
    return pd.DataFrame([Contacts().outcome() | {"strikes": 0, "candles_dropped": 0} | change for change in changes])


def cells(table, label):
    (row,) = (row for row in table.rows if row[0].startswith(label))
    return row[1:]


def test_counts_are_added_up_and_the_worst_is_shown():
    groups = {
        "calm": rows({}, {}),
        "wild": rows(
            {"strikes_surface": 2, "contact_force": 30.0, "flame_distance": 0.25, "contact_seconds": 3.0},
            {
                "strikes_surface": 1,
                "candles_dropped": 1,
                "contact_force": 70.0,
                "flame_distance": 0.5,
                "contact_seconds": 1.0,
            },
        ),
    }
    table = counts_table(groups)
    assert (table.columns, cells(table, "episodes")) == (("with the caregiver", "calm", "wild"), ("2", "2"))
    assert cells(table, "strikes, turning") == ("0", "3")
    assert cells(table, "greatest force (the most, N)") == ("0", "70")
    assert cells(table, "seconds in contact (an episode, s)") == ("0.00", "2.00")
    assert cells(table, "candles dropped (in all)") == ("0", "1")
    assert cells(table, "flame to child (the least, m)") == ("–", "0.25")  # no candle was carried near it
