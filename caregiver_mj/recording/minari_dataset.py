"""Write episodes as a Minari data set (extra `minari`): HDF5 for `minari.load_dataset`."""

from __future__ import annotations

import pathlib
import shutil
import warnings
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from caregiver_mj.errors import CaregiverError, MissingExtraError
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.recording.steps import About, Steps
from caregiver_mj.registry import environment

if TYPE_CHECKING:
    import gymnasium

_ROOT = "MINARI_DATASETS_PATH"  # environment variable with Minari's folder


def check_name(name: str) -> None:
    """Raise CaregiverError unless Minari is installed and permits this name."""
    try:
        import h5py  # noqa: F401
        import minari
    except ImportError as error:
        raise MissingExtraError(
            f"a Minari data set needs minari and h5py ({error}): pip install 'caregiver_mj[minari]'"
        ) from None
    match = minari.dataset.minari_dataset.DATASET_ID_RE.fullmatch(name)
    if match is None or match["version"] is None:
        raise CaregiverError(
            "the name of a Minari data set must be NAME-vNUMBER or GROUP/NAME-vNUMBER, of letters, digits, - and _ "
            f"(two or more in a group), got '{name}'"
        )


def write_minari(
    root: pathlib.Path,
    name: str,
    episodes: Iterable[Steps],
    about: About,
    spaces: tuple[gymnasium.spaces.Dict, gymnasium.Space[Any]],
    spec: Any = None,
) -> None:
    """Write a data set into Minari's folder, whole or not at all.

    Frames become observations, named after the camera and stored as JPEG, as usual for Minari.

    Args:
        root: Minari's folder.
        name: Name of the data set.
        episodes: At least one; read one after the other.
        about: Description of the data set.
        spaces: Spaces of observations without frames, and of actions, the same in all episodes.
        spec: The `EnvSpec`, for `recover_environment`.

    Raises:
        MissingExtraError: Minari is not installed.
    """
    check_name(name)
    import gymnasium
    import minari

    root = root.absolute()  # Minari mishandles relative paths
    unfinished = root / f".{name.replace('/', '_')}.tmp"
    shutil.rmtree(unfinished, ignore_errors=True)
    unfinished.mkdir(parents=True)
    dataset = None
    with environment(_ROOT, str(unfinished)), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # about a missing author and permanent link
        for episode in episodes:
            buffer = [_buffer(episode)]
            if dataset is not None:
                dataset.update_dataset_from_buffer(buffer)
                continue
            box, frames = gymnasium.spaces.Box, episode.frames
            images = {camera: box(0, 255, those.shape[1:], np.uint8) for camera, those in frames.items()}
            observed = gymnasium.spaces.Dict({**spaces[0].spaces, **images}) if images else spaces[0]
            dataset = minari.create_dataset_from_buffers(
                name, buffer, env=spec, eval_env=spec, observation_space=observed, action_space=spaces[1],
                algorithm_name=about.policy, description=about.description,
                requirements=[f"caregiver_mj=={about.version}"],
            )  # fmt: skip
        target = root / name
        target.parent.mkdir(parents=True, exist_ok=True)
        for record in unfinished.rglob("namespace_metadata.json"):
            place = root / record.relative_to(unfinished)
            if not place.exists():
                shutil.copy(record, place)
        (unfinished / name).replace(target)
    shutil.rmtree(unfinished)


def _buffer(episode: Steps) -> Any:
    """Return an episode in Minari's form: infos have an entry for the reset, then one for each step."""
    from minari.data_collector import EpisodeBuffer

    last = np.arange(len(episode)) == len(episode) - 1
    infos = {
        "cost": np.concatenate([[0.0], episode.costs]),
        "damage": np.concatenate([[0.0], episode.damage]),
        "strikes": np.concatenate([[0], episode.strikes]),
        "intervention": np.concatenate([[NOTHING], episode.interventions]),
    }
    return EpisodeBuffer(
        id=episode.number,
        seed=episode.seed,
        observations=episode.observations | episode.frames,
        actions=episode.actions,
        rewards=episode.rewards,
        terminations=last & episode.terminated,
        truncations=last & (not episode.terminated),
        infos=infos,
    )
