"""An episode is the same on processors for which BLAS takes other kernels, and by every Python."""

import os
import subprocess
import sys

import pytest
from wheels import ROOT

EPISODE = """
import hashlib, sys
import caregiver_mj
import numpy as np
from caregiver_mj.house.touch import _on_child

env = caregiver_mj.load("supervise", "house-17", "adversary:0", random=2, visuals=False)
policy, step, states = caregiver_mj.CaregiverPolicy(env, sys.argv[1]), env.reset(), hashlib.sha256()
for _ in range(1500):
    step = env.step(policy(step))
    states.update(env.physics.data.qpos.tobytes())
outcome = env.task.outcome()
assert outcome["contact_seconds"] > 0
states.update(repr(outcome).encode())
random = np.random.default_rng(0)
for surface, normal in random.normal(size=(500, 2, 3)):  # a contact too seldom comes to a last digit
    states.update(repr(_on_child(surface, normal)).encode())
product = random.normal(size=(50, 50)) @ random.normal(size=(50, 50))
print(states.hexdigest(), hashlib.sha256(product.tobytes()).hexdigest())
"""


@pytest.mark.slow
@pytest.mark.parametrize("caregiver", ["expected-danger", "foresight"])
def test_a_house_is_the_same_whatever_the_processor(caregiver):
    states, products = set(), set()
    for kernel in ({}, *({"OPENBLAS_CORETYPE": name} for name in ("Haswell", "Nehalem"))):  # this machine's own first
        environment = os.environ | kernel
        command = [sys.executable, "-c", EPISODE, caregiver]
        ran = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        state, product = ran.stdout.split()
        states.add(state)
        products.add(product)
    if len(products) == 1:
        pytest.skip("NumPy's BLAS is another one, or does not do as it is told here")
    assert len(states) == 1


@pytest.mark.slow
def test_a_house_is_the_same_by_every_python():
    """Compare with the other environments that `scripts/_setup.sh` has made here, as CI does with the newest."""
    pythons = {sys.executable, *map(str, (stamp.parent / "bin" / "python" for stamp in ROOT.glob(".venv*/installed")))}
    if len(pythons) == 1:
        pytest.skip("there is one Python here")
    commands = [[python, "-c", EPISODE, "expected-danger"] for python in pythons]
    found = {subprocess.run(command, capture_output=True, text=True, check=True).stdout for command in commands}
    assert len(found) == 1
