"""LeRobot data sets, read back as the format's third version is documented: rows, films, and what is said of them."""

import json

import imageio_ffmpeg
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from caregiver_mj.recording.lerobot_dataset import FILES_IN_CHUNK, Shard, write_lerobot
from caregiver_mj.recording.steps import About, Steps

ABOUT = About("Guard: stand there.", "made_up", "nobody", 50.0, ("left", "right"), ("stairwell 1",), "9.9")
LENGTHS = (7, 4, 9)
HEIGHT, WIDTH = 32, 48
COUNTERS = {"timestamp", "frame_index", "episode_index", "index", "task_index"}
KEY = "observation.images.door"


def made_up(number, length):
    """An episode in which every number is another one, and every frame has a bright square of its own."""
    random = np.random.default_rng(number)
    frames = np.full((length + 1, HEIGHT, WIDTH, 3), 40, np.uint8)
    for i, frame in enumerate(frames):
        frame[8 * (number % 3) : 8 * (number % 3) + 8, 4 * i : 4 * i + 8] = 230
    return Steps(
        number=number,
        seed=1000 + number,
        observations={"clock": np.arange(length + 1.0)[:, None], "pose": random.normal(size=(length + 1, 2, 3))},
        actions=random.normal(size=(length, 2)).astype(np.float32),
        rewards=random.random(length),
        costs=random.random(length),
        damage=random.random(length),
        strikes=random.integers(0, 2, length),
        interventions=random.integers(-1, 1, length),
        terminated=number == 1,
        diverged=number == 2,
        outcome={},
        frames={"door": frames},
    )


@pytest.fixture(scope="module")
def episodes():
    return [made_up(number, length) for number, length in enumerate(LENGTHS)]


@pytest.fixture(scope="module")
def folder(episodes, tmp_path_factory):
    folder = tmp_path_factory.mktemp("lerobot") / "set"
    write_lerobot(folder, iter(episodes), ABOUT)
    assert [path.name for path in folder.parent.iterdir()] == ["set"]  # and nothing unfinished
    return folder


@pytest.fixture(scope="module")
def info(folder):
    return json.loads((folder / "meta/info.json").read_text())


@pytest.fixture(scope="module")
def listed(folder):
    return pd.read_parquet(folder / "meta/episodes/chunk-000/file-000.parquet")


def test_features_are_described_as_they_are(info, folder):
    assert info["codebase_version"] == "v3.0"
    assert (info["total_episodes"], info["total_frames"], info["total_tasks"]) == (3, sum(LENGTHS), 1)
    assert (info["fps"], info["robot_type"], info["splits"]) == (50, "made_up", {"train": "0:3"})
    assert min(info["chunks_size"], info["data_files_size_in_mb"], info["video_files_size_in_mb"]) > 0
    described = info["features"]
    assert COUNTERS | {"observation.state", "action", KEY, "next.reward", "next.done"} <= set(described)
    assert all({"dtype", "shape", "names"} <= set(feature) for feature in described.values())
    assert described["observation.state"]["names"] == ["clock", *(f"pose_{i}" for i in range(6))]
    assert (described["action"]["names"], described[KEY]["dtype"]) == (["left", "right"], "video")
    assert described[KEY]["shape"] == [HEIGHT, WIDTH, 3]
    schema = pq.read_schema(folder / info["data_path"].format(chunk_index=0, file_index=0))
    described = {name: feature for name, feature in info["features"].items() if feature["dtype"] != "video"}
    assert set(schema.names) == set(described)
    types = {"float32": pa.float32(), "int64": pa.int64(), "bool": pa.bool_()}
    for name, feature in described.items():
        kind, (size,) = types[feature["dtype"]], feature["shape"]
        assert schema.field(name).type == (kind if size == 1 else pa.list_(kind, size)), name


def test_rows_are_those_of_the_episodes(folder, episodes):
    path = folder / "data/chunk-000/file-000.parquet"
    assert pq.ParquetFile(path).num_row_groups == len(LENGTHS)
    rows = pd.read_parquet(path)
    assert rows["index"].tolist() == list(range(sum(LENGTHS)))
    for episode in episodes:
        own = rows[rows.episode_index == episode.number]
        assert own.frame_index.tolist() == list(range(len(episode)))
        np.testing.assert_allclose(own.timestamp, np.arange(len(episode)) / 50, rtol=1e-6)
        np.testing.assert_array_equal(np.stack(own.action), episode.actions)
        state = np.stack(own["observation.state"])
        np.testing.assert_allclose(state[:, 0], episode.observations["clock"][:-1, 0], rtol=1e-6)
        np.testing.assert_allclose(state[:, 1:], episode.observations["pose"][:-1].reshape(-1, 6), rtol=1e-6)
        for name, values in (("reward", episode.rewards), ("cost", episode.costs), ("damage", episode.damage)):
            np.testing.assert_allclose(own[f"next.{name}"], values, rtol=1e-6)
        assert own["next.strikes"].tolist() == episode.strikes.tolist()
        assert own.intervention.tolist() == episode.interventions.tolist()
        last = [False] * (len(episode) - 1) + [True]
        assert own["next.done"].tolist() == last
        assert own["next.truncated"].tolist() == [one and not episode.terminated for one in last]


def test_the_film_shows_each_row_its_own_frame(folder, info, listed, episodes):
    reader = imageio_ffmpeg.read_frames(folder / info["video_path"].format(video_key=KEY, chunk_index=0, file_index=0))
    meta = next(reader)
    assert (meta["fps"], tuple(meta["size"]), meta["codec"]) == (50.0, (WIDTH, HEIGHT), "h264")
    film = np.stack([np.frombuffer(frame, np.uint8).reshape(HEIGHT, WIDTH, 3) for frame in reader])
    assert len(film) == sum(LENGTHS)
    for episode, row in zip(episodes, listed.to_dict("records"), strict=True):
        first, end = (round(row[f"videos/{KEY}/{which}_timestamp"] * 50) for which in ("from", "to"))
        assert (first, end) == (row["dataset_from_index"], row["dataset_to_index"])
        wanted = episode.frames["door"][:-1]
        bright = film[first:end].mean(axis=-1) > 135
        agree = (bright == (wanted.mean(axis=-1) > 135)).mean(axis=(1, 2))
        assert agree.min() > 0.98  # and 64 pixels more or less in the wrong place are 4 %


def test_statistics_are_those_of_the_rows(folder, listed, info):
    stats = json.loads((folder / "meta/stats.json").read_text())
    rows = pd.read_parquet(folder / "data/chunk-000/file-000.parquet")
    assert set(stats) == set(info["features"])
    for name in ("action", "observation.state", "next.reward", "next.done"):
        values = np.stack(rows[name]).astype(float).reshape(len(rows), -1)
        for what, wanted in (("min", values.min(0)), ("max", values.max(0)), ("mean", values.mean(0))):
            np.testing.assert_allclose(stats[name][what], wanted, atol=1e-9)
        np.testing.assert_allclose(stats[name]["std"], values.std(0), atol=1e-9)
        assert stats[name]["count"] == [len(rows)]
        first = values[: LENGTHS[0]]
        np.testing.assert_allclose(listed[f"stats/{name}/q50"][0], np.median(first, axis=0), atol=1e-9)
    assert np.shape(stats[KEY]["mean"]) == (3, 1, 1)
    assert 0 <= stats[KEY]["min"][0][0][0] < stats[KEY]["mean"][0][0][0] < stats[KEY]["max"][0][0][0] <= 1


def test_large_data_sets_have_several_files_and_after_many_another_chunk(tmp_path, episodes):
    write_lerobot(tmp_path / "set", episodes, ABOUT, megabytes=(1e-4, 1e-4))
    data = sorted((tmp_path / "set/data/chunk-000").iterdir())
    assert [pq.read_metadata(path).num_rows for path in data] == list(LENGTHS)
    assert len(list((tmp_path / "set/videos" / KEY / "chunk-000").iterdir())) == 3
    listed = pd.read_parquet(tmp_path / "set/meta/episodes/chunk-000/file-000.parquet")
    assert listed["data/file_index"].tolist() == [0, 1, 2]
    assert listed[f"videos/{KEY}/file_index"].tolist() == [0, 1, 2]
    assert listed[f"videos/{KEY}/from_timestamp"].tolist() == [0.0, 0.0, 0.0]
    last = Shard(FILES_IN_CHUNK - 1)
    assert last.place == {"chunk_index": 0, "file_index": FILES_IN_CHUNK - 1}
    assert Shard(last.number + 1).columns("data") == {"data/chunk_index": 1, "data/file_index": 0}
