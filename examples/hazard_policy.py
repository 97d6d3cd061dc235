"""A policy that fits any house: one network looks at every hazard, so in which slot one is does not matter."""

from __future__ import annotations

import needs_learn  # noqa: F401 (says so if it is missing)

# isort: split
import torch
from gymnasium import spaces
from sb3_contrib.common.maskable.policies import MaskableActorCriticPolicy
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import nn

_COMMON = ("clock", "child_position", "child_move", "caregiver_position")
_OF_HAZARDS = ("hazard_damage", "hazard_nearness_to_child", "hazard_nearness_to_caregiver", "holding", "before")
_OF_ACTIONS = ("under_way", "action_mask")  # the first of them is of doing nothing


class EachAction(BaseFeaturesExtractor):
    """What is seen of each action, of one array: first that of doing nothing, for which what hazards have is 0."""

    def __init__(self, space: spaces.Dict):
        self.actions = space["action_mask"].shape[0]
        common = sum(spaces.flatdim(space[key]) for key in _COMMON)
        of_hazards = sum(spaces.flatdim(space[key]) // (self.actions - 1) for key in _OF_HAZARDS)
        self.each = common + of_hazards + len(_OF_ACTIONS) + 1
        super().__init__(space, self.actions * self.each)

    def forward(self, seen: dict[str, torch.Tensor]) -> torch.Tensor:
        batch, rows = len(seen["action_mask"]), []
        for key in _OF_HAZARDS:
            rows.append(nn.functional.pad(seen[key].reshape(batch, -1, self.actions - 1), (1, 0)))
        rows += [seen[key][:, None] for key in _OF_ACTIONS]
        common = torch.cat([seen[key].reshape(batch, -1) for key in _COMMON], 1)
        rows.append(common[:, :, None].expand(-1, -1, self.actions))
        nothing = torch.zeros(batch, 1, self.actions)
        nothing[:, :, 0] = 1
        return torch.cat([*rows, nothing], 1).transpose(1, 2).flatten(1)


class EachHazard(nn.Module):
    """Answers with a score of each action, and with what the value is made of: the mean of all that can be done."""

    def __init__(self, actions: int, each: int, width: int = 64):
        super().__init__()
        self.shape = actions, each
        self.look = nn.Sequential(nn.Linear(each, width), nn.Tanh(), nn.Linear(width, width), nn.Tanh())
        self.score, self.value = nn.Linear(width, 1), nn.Linear(width, width)
        self.latent_dim_pi, self.latent_dim_vf = actions, width

    def forward(self, features: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        seen = self.look(features.unflatten(1, self.shape))
        return self.score(seen).squeeze(-1), torch.tanh(self.value(seen.mean(1)))

    def forward_actor(self, features: torch.Tensor) -> torch.Tensor:
        return self(features)[0]

    def forward_critic(self, features: torch.Tensor) -> torch.Tensor:
        return self(features)[1]


class HazardPolicy(MaskableActorCriticPolicy):
    """The policy of both."""

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **{**kwargs, "features_extractor_class": EachAction})

    def _build_mlp_extractor(self) -> None:
        self.mlp_extractor = EachHazard(self.features_extractor.actions, self.features_extractor.each)

    def _build(self, lr_schedule) -> None:
        super()._build(lr_schedule)
        self.action_net = nn.Identity()  # the scores are what it would make
        with torch.no_grad():
            self.mlp_extractor.score.weight *= 0.01  # at first nothing is preferred
        self.optimizer = self.optimizer_class(self.parameters(), lr=lr_schedule(1), **self.optimizer_kwargs)
