"""The report of finished runs."""

from caregiver_mj.viz.report.page import write_report
from caregiver_mj.viz.report.reading import read_run
from caregiver_mj.viz.report.run import Run

__all__ = ["Run", "read_run", "write_report"]
