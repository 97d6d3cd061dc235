"""Former home of the references."""

from caregiver_mj.robot.base_path import BasePath  # noqa: F401
from caregiver_mj.robot.ruckig_calls import PathError  # noqa: F401
from caregiver_mj.robot.scalar_motion import ScalarMotion  # noqa: F401
