"""Compare LeRobot's reading of data sets of `caregiver-mj record` with Minari's reading of the same episodes.

LeRobot needs other versions of libraries, hence its own virtual environment of several gigabytes, so this is no test of
the suite. The exit status is 1 if the two differ.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

LEROBOT = "lerobot==0.4.4"
CAMERA = "wrist"
SAID = ["--house", "paper", "--seed", "7", "--episodes", "2", "--seconds", "2", "--camera", CAMERA, "--size", "64x48"]
PIXELS = 12  # grey values of 255; tolerated mean difference of an image by video compression

# Program for LeRobot's environment.
READER = """
import json, sys
import numpy as np
from lerobot.datasets.lerobot_dataset import LeRobotDataset
found = LeRobotDataset("any/name", root=sys.argv[1], video_backend="pyav")  # the other one wants the system's FFmpeg
rows = [found[i] for i in range(len(found))]
columns = {key: np.stack([np.asarray(row[key]) for row in rows]) for key in rows[0] if key != "task"}
np.savez(sys.argv[2], **columns)
print(json.dumps({"episodes": found.num_episodes, "fps": found.fps, "tasks": sorted({row["task"] for row in rows})}))
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--python", type=pathlib.Path, help="of an environment that has LeRobot; made if not given")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        record(folder, "minari", ["--out", "minari", "--name", "beside-v0"])
        record(folder, "lerobot", ["--out", "lerobot"])
        about, columns = read(arguments.python or with_lerobot(folder), folder)
        sys.exit(compare(about, columns, folder))


def record(folder, form, where):
    """Record the episodes in a format, with the package of this environment."""
    command = [sys.executable, "-m", "caregiver_mj", "record", "--format", form, *SAID, *where]
    subprocess.run(command, cwd=folder, check=True)


def with_lerobot(folder):
    """Return the Python of a new environment with LeRobot."""
    subprocess.run([sys.executable, "-m", "venv", folder / "venv"], check=True)
    python = folder / "venv" / "bin" / "python"
    subprocess.run([python, "-m", "pip", "install", "-qq", "--disable-pip-version-check", LEROBOT], check=True)
    return python


def read(python, folder):
    """Return LeRobot's summary and columns of the data set."""
    command = [python, "-c", READER, folder / "lerobot", folder / "columns.npz"]
    done = subprocess.run(command, cwd=folder, check=True, stdout=subprocess.PIPE, text=True)
    with np.load(folder / "columns.npz") as columns:
        return json.loads(done.stdout.splitlines()[-1]), dict(columns)


def state(episode):
    """Return the observations other than images, without the last, (steps, values)."""
    found = [values[:-1] for key, values in episode.observations.items() if key != CAMERA]
    return np.concatenate([values.reshape(len(values), -1) for values in found], axis=1)


def compare(about, columns, folder):
    """Print the differences of both readers; return 1 if they exceed the tolerances."""
    os.environ["MINARI_DATASETS_PATH"] = str(folder / "minari")
    import minari  # reads the variable on import

    episodes = list(minari.load_dataset("beside-v0").iterate_episodes())
    steps = [len(episode) for episode in episodes]
    wanted = {
        "action": np.concatenate([episode.actions for episode in episodes]),
        "next.reward": np.concatenate([episode.rewards for episode in episodes]),
        "observation.state": np.concatenate([state(episode) for episode in episodes]),
        "episode_index": np.repeat(np.arange(len(steps)), steps),
        "frame_index": np.concatenate([np.arange(count) for count in steps]),
    }
    differs = about["episodes"] != len(episodes)
    for key, values in wanted.items():
        off = np.abs(columns[key].reshape(values.shape) - values).max()
        differs |= off > 1e-5  # single precision
        print(f"{key}: {values.shape}, {off:.1e} off at most")
    pictures = np.concatenate([np.array(episode.observations[CAMERA])[:-1] for episode in episodes])
    seen = 255 * columns[f"observation.images.{CAMERA}"].transpose(0, 2, 3, 1)
    off = np.abs(seen - pictures).mean(axis=(1, 2, 3)).max()
    differs |= off > PIXELS
    print(f"pictures: {pictures.shape}, {off:.1f} of 255 off on average at most, by compression")
    print(f"{about['episodes']} episodes, {about['fps']} steps a second, {about['tasks']}")
    return int(differs)


if __name__ == "__main__":
    main()
