"""Gymnasium environments, registered under `caregiver_mj/`: the tasks, and supervision by targets in both worlds.

Importing this room registers them without loading MuJoCo.
"""

from caregiver_mj.errors import MissingExtraError

try:
    import gymnasium
except ImportError as error:
    raise MissingExtraError(f"caregiver_mj.envs needs gymnasium ({error}): pip install 'caregiver_mj[gym]'") from None

from caregiver_mj.tasks import TASKS, register

for _task in tuple(TASKS.values()):
    if _task.id not in gymnasium.registry:
        register(_task)
TARGETS_ID = "caregiver_mj/Supervise-Targets-v0"
gymnasium.register(
    TARGETS_ID,
    "caregiver_mj.envs.targets:make_targets",
    vector_entry_point="caregiver_mj.envs.target_grid:GridTargetsVector",
)
