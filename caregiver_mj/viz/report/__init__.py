"""The report of finished runs."""

from caregiver_mj.viz.report.page import write_report
from caregiver_mj.viz.report.run import Run, read_run

__all__ = ["Run", "read_run", "write_report"]
