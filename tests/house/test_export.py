"""Exported scenes, loaded where this package is not."""

import subprocess
import sys

import mujoco
import numpy as np
import pytest

from caregiver_mj import FloorPlan, cli
from caregiver_mj.house.export import export_house
from caregiver_mj.house.physics import Physics
from caregiver_mj.robot.embodiments import find_embodiment

# A landing, a gate, a candle, a mug, and so many batteries that its Jacobians are sparse ones.
PLAN = """\
###########
###S####G##
#.........#
#.ooooooo.#
#.ooooooo.#
#.ooooooo.#
#.ooooooo.#
#.........#
##B#C#M#T##
###########
"""
# Load files, step each from its keyframe, and print whether Jacobians are sparse, warnings, time and what moved.
LOAD = """
import sys
import mujoco, numpy as np
for file in sys.argv[1:]:
    load = mujoco.MjModel.from_xml_path if file.endswith("xml") else mujoco.MjModel.from_binary_path
    model = load(file)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    start = data.qpos.copy()
    for _ in range(1000):
        mujoco.mj_step(model, data)
    print(model.opt.jacobian, max(w.number for w in data.warning), round(data.time, 3), abs(data.qpos - start).max())
assert "caregiver_mj" not in sys.modules
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scenes")
    (folder / "house.txt").write_text(PLAN)
    return folder


def test_scenes_load_and_step_in_plain_mujoco(capsys, folder, tmp_path):
    files = []
    for robot in ([], ["--robot", "mobile_fr3"]):
        for kind in ("xml", "mjb"):
            files.append(folder / f"{'with' if robot else 'without'}.{kind}")
            argv = ["house", "export", str(folder / "house.txt"), "--out", str(files[-1]), *robot]
            assert cli.main(argv) == 0
            written = capsys.readouterr().out.split()
            assert written[0] == str(files[-1])
            assert len(written) == (3 if kind == "xml" else 1)  # floor and grass
    command = [sys.executable, "-W", "error", "-c", LOAD, *map(str, files)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)  # and from another folder
    assert done.returncode == 0, done.stderr
    assert not [*tmp_path.iterdir()]  # MuJoCo writes its warnings to a file there
    for line in done.stdout.splitlines():
        jacobian, warnings, seconds, moved = map(float, line.split())
        assert jacobian == int(mujoco.mjtJacobian.mjJAC_SPARSE)
        assert (warnings, seconds) == (0, 5)
        assert moved < 0.02  # all stands where it stood: metres and radians
    assert done.stdout.count("\n") == len(files)


def test_scenes_are_the_house(folder):
    plan, robot = FloorPlan.parse(PLAN), find_embodiment("mobile_ur5e")
    theirs = Physics.from_plan(plan, robot).model.ptr
    names = [name for name in dir(theirs) if not name.startswith(("_", "key_", "name_", "tex_", "names", "ptr"))]
    for kind in ("xml", "mjb"):
        export_house(plan, file := folder / f"{robot.name}.{kind}", robot)
        load = mujoco.MjModel.from_xml_path if kind == "xml" else mujoco.MjModel.from_binary_path
        model = load(str(file))
        compared = 0
        for name in names:
            value = getattr(theirs, name)
            if isinstance(value, np.ndarray) and (name, kind) != ("dof_length", "xml"):  # which no MJCF can say
                np.testing.assert_allclose(getattr(model, name), value, rtol=1e-5, atol=1e-4, err_msg=name)
                compared += 1
        assert compared > 100
