"""Adapter of vector environments to Stable-Baselines3, which does not take those of Gymnasium."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector.utils import iterate
from gymnasium.wrappers.vector import DictInfoToList

from caregiver_mj.errors import CaregiverError, MissingExtraError

try:
    from stable_baselines3.common.vec_env import VecEnv
except ImportError as error:
    raise MissingExtraError(
        f"caregiver_mj.envs.sb3 needs stable-baselines3 ({error}): pip install 'caregiver_mj[learn]'"
    ) from None


class BatchVecEnv(VecEnv):
    """A `VecEnv` of a batch whose episodes begin and end together: from `make_vec`, `GridHousesVector`, or wrappers.

    Observations are `flat` arrays for `MlpPolicy`, or dictionaries for `MultiInputPolicy`. The step that ends the
    episodes returns the first observations of the next ones; each `info` then has `terminal_observation`,
    `TimeLimit.truncated`, `outcome` and `episode_score`. Other infos are those of the batch.

    `env_method("action_masks")` serves sb3-contrib's `MaskablePPO`. After `seed(n)` the next reset uses the seeds from
    n on. `VecMonitor` around it logs the returns.

    Attributes:
        env: The batch.
    """

    def __init__(self, env: gymnasium.vector.VectorEnv):
        """Wrap a batch that resets on the next step, like those of this package.

        Raises:
            CaregiverError: `env` is no vector environment, or has another autoreset mode.
        """
        if not isinstance(env, gymnasium.vector.VectorEnv):
            raise CaregiverError(f"env must be a vector environment, got {env!r}: gymnasium.make_vec makes one")
        mode = env.metadata.get("autoreset_mode")
        if mode is not gymnasium.vector.AutoresetMode.NEXT_STEP:
            raise CaregiverError(f"autoreset_mode of the vector environment must be NEXT_STEP, got {mode}")
        self.env, self._listed = env, DictInfoToList(env)
        self._infos: list[dict[str, Any]] = []  # infos of the last observations
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

    def reset(self) -> Any:
        seed, _ = self._seeds[0], self._reset_seeds()
        observations, self.reset_infos = self._listed.reset(seed=seed)
        self._infos = self.reset_infos
        return observations

    def step_async(self, actions: np.ndarray) -> None:
        self._actions = actions

    def step_wait(self) -> tuple[Any, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        observations, rewards, terminated, truncated, infos = self._listed.step(self._actions)
        ended, self._infos = terminated | truncated, infos
        if ended.any():
            if not ended.all():
                raise CaregiverError("episodes of the batch must end together, got some that go on")
            last = iterate(self.env.observation_space, observations)
            for info, seen, over in zip(infos, last, (truncated & ~terminated).tolist(), strict=True):
                info |= {"terminal_observation": seen, "TimeLimit.truncated": over}
            observations, self.reset_infos = self._listed.reset()
            self._infos = self.reset_infos
        return observations, rewards.astype(np.float32), ended, infos

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        if method_name != "action_masks":
            raise AttributeError(f"a batch of episodes has no method '{method_name}': it has action_masks")
        if not self._infos or "action_mask" not in self._infos[0]:
            raise gymnasium.error.ResetNeeded("call reset() first, of a batch with masks")
        return [self._infos[i]["action_mask"].astype(bool) for i in self._get_indices(indices)]

    def has_attr(self, attr_name: str) -> bool:
        return attr_name == "action_masks" or hasattr(self.env, attr_name)

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        return [getattr(self.env, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        raise AttributeError(f"'{attr_name}' of a batch of episodes cannot be set")

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        return [False] * len(list(self._get_indices(indices)))

    def get_images(self) -> Sequence[np.ndarray | None]:
        pictures: Any = self.env.render()
        return pictures or [None] * self.num_envs

    def close(self) -> None:
        self.env.close()
