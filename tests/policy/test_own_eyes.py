"""A robot with its own eyes: what is shown to it, and what it does."""

import math

import dm_env
import numpy as np
import pytest
from views import ROBOT, child, view

import caregiver_mj
from caregiver_mj import FloorPlan
from caregiver_mj.children.walk import BUMP_SPEED, WALKING_SPEED
from caregiver_mj.experiments.spec import episode_random
from caregiver_mj.plans.visibility import PLACES, Sight
from caregiver_mj.policy.perception import Perception
from caregiver_mj.robot import separation
from caregiver_mj.robot.clearance import Clearance

ROOMS = FloorPlan.parse(
    """
###############
#....#...#....#
#.C..#...#..T.#
#....#...#....#
#.............#
##S###...####B#
###############
""",
    "rooms",
)


def load(family, seed, sight="walls"):
    return caregiver_mj.load("supervise", ROOMS, family, random=seed, task_kwargs={"sight": sight})


def episode(env, caregiver="foresight", seconds=30.0):
    policy = caregiver_mj.CaregiverPolicy(env, caregiver)
    timestep, found = env.reset(), []
    while env.physics.time() < seconds:
        action = policy(timestep)
        found.append((timestep.observation, action, env.physics.toddler_positions()))
        timestep = env.step(action)
    return found


@pytest.mark.parametrize("sight", ["walls", "camera"])
def test_who_heads_for_the_robot_is_not_struck(sight):
    env = load("adversary:0", 3, sight)
    episode(env, "expected-danger", 60.0)
    outcome = env.task.outcome()
    assert 0.0 < outcome["seen"] <= 1.0
    assert outcome["contact_seconds"] > 0.0
    assert outcome["strikes"] == outcome["strikes_surface"] == outcome["candles_dropped"] == 0


def test_it_comes_slowly_to_a_corner_behind_which_a_child_may_be():
    seen, speed = view(), 1.0
    assert separation.allowed_rate(seen, ROBOT, (speed, 0.0)) == 1.0
    rates = []
    for far in (0.45, 0.6, 0.8, 1.2, 3.0):
        seen.lurking = (child(far, 0.0),)
        rates.append(separation.allowed_rate(seen, ROBOT, (speed, 0.0)))
    assert rates[0] == pytest.approx(0.03)  # slower than a strike
    assert rates == sorted(rates)
    assert rates[2] < 0.6
    assert rates[-1] == 1.0
    seen.lurking = (child(0.45, 0.0),)
    assert separation.allowed_rate(seen, ROBOT, (speed, 0.0), (-10.0, 0.0)) == pytest.approx(0.015)  # now it is 2 m/s
    seen.lurking = (child(3.0, 0.0),)
    assert separation.allowed_rate(seen, ROBOT, (-speed, 0.0)) == 1.0


def test_it_turns_slowly_beside_a_place_where_a_child_may_be_unseen():
    seen, behind = view(), (child(-0.45, 0.0),)
    seen.lurking = behind
    turning = lambda: separation.allowed_turning(seen, ROBOT, (0.0, 0.0), (0.0, 0.0))  # noqa: E731
    assert turning() == np.inf  # it sees it as it comes
    seen.gaze = 0.0  # it does not
    assert 0.02 < turning() * ROBOT.footprint < 0.05  # slower than a strike, but it turns to look
    seen.lurking, seen.hidden, seen.gaze = (), behind, None
    assert 0.02 < turning() * ROBOT.footprint < 0.05


@pytest.fixture
def perception():
    """What a robot in the middle of the crossing makes of what it sees, a second after the start."""
    made = Perception(ROOMS, sight=Sight.of("camera"))
    made.reset(observed())
    return made


def observed(heading=0.0, seen=((4, 7),)):
    """What a robot sees that stands below the middle of the house, and no child but that in view of some cells."""
    cells = np.zeros((len(ROOMS.free_cells), 5))
    cells[[ROOMS.cell_index[cell] for cell in seen]] = 1.0
    return {
        "toddler_position": np.zeros(3),
        "toddler_velocity": np.zeros(3),
        "toddler_seen": np.zeros(1),
        "cell_seen": cells,
        "clock": np.zeros(()),
        "base_position": np.array([*ROOMS.position((4, 7)), heading]),
        "arm_position": np.zeros(7),
        "finger_position": np.zeros(2),
    }


def believe(perception, *cells):
    """Have it believe that the child is as likely in one cell as in another."""
    joint = perception._tracker.joint
    joint[:] = 0.0
    for cell in cells:
        joint[0, 0, ROOMS.cell_index[cell]] = perception._tracker.probability[0, 0] / len(cells)


def test_it_looks_where_the_child_is_most_likely_and_then_elsewhere(perception):
    believe(perception, (4, 11), (4, 10), (4, 2))
    assert perception.look(observed(), 0.0).gaze == 0.0
    assert abs(perception.look(observed(), 0.1).gaze) == pytest.approx(np.pi)  # it has seen nothing in the east
    believe(perception, (1, 1))
    assert perception.look(observed(1.5), 0.2).gaze == 1.5  # from here it would not see it anyway


def test_an_unlikely_child_may_be_as_far_off_its_cell_as_it_has_walked(perception):
    believe(perception, *[cell for cell in ROOMS.free_cells if cell[0] != 4], (4, 9))
    perception._tracker.joint[0, 0, ROOMS.cell_index[4, 9]] *= 1e-6  # no child as is believed in would go there
    far = []
    for now, clock in enumerate((3.0, 3.25, 3.5, 3.75)):
        view = perception.look(observed() | {"clock": np.array(clock)}, float(now))
        far.append(min(child.position[0] - view.base[0] for child in view.lurking if child.position[0] > 1.0))
        assert view.hidden == ()
    margin = 1.5 - far[0]
    assert 0.0 < margin < 0.1
    walked = 0.0, 0.1875 * BUMP_SPEED / WALKING_SPEED, 0.375, 0.1875
    assert far == pytest.approx([1.5 - margin - off for off in walked])


def test_a_child_is_not_where_it_would_be_seen_in_a_cell_in_which_it_may_be(perception):
    believe(perception, (4, 9))  # two cells east of the base
    base, cell = ROOMS.position((4, 7)), ROOMS.cell_index[4, 9]
    beside = [ROOMS.cell_index[4, 8], ROOMS.cell_index[4, 10]]
    east = int(np.argmax(PLACES[:, 0]))
    away = []
    for now, hidden in enumerate((range(5), [0, east], [east], [])):
        seen = observed(seen=()) | {"clock": np.array(3.5)}
        seen["cell_seen"][beside] = 1.0
        seen["cell_seen"][cell] = [float(place not in hidden) for place in range(5)]
        view = perception.look(seen, float(now))
        away.append([child.position[0] - base[0] for child in view.lurking])
    west = int(np.argmin(PLACES[:, 0]))
    seen["cell_seen"][cell, west] = 0.0
    for now, (clock, places) in enumerate(((3.0, 0), (3.5, 1)), 10):  # it has not walked so far yet, and then it has
        assert len(perception.look(seen | {"clock": np.array(clock)}, float(now)).lurking) == places
    margin = 0.1 * BUMP_SPEED
    assert away == [pytest.approx([1.5 - off - margin]) for off in (0.375, 0.1125, -0.075)] + [[]]


def test_a_child_may_be_a_cell_beyond_its_own_but_not_at_the_base_or_where_it_would_be_seen(perception):
    believe(perception, (4, 8))  # beside the base, and itself beside three more
    for now, (seen, places) in enumerate([((), 4), (((4, 9),), 3)]):
        view = perception.look(observed(seen=seen), float(now))
        assert len(view.lurking) == places
        assert min(math.dist(child.position, view.base[:2]) for child in view.lurking) > 0.6


@pytest.mark.parametrize(
    ("house", "seed", "seconds"),
    [
        ("house-960006", 2079939347, 8.0),  # it walks faster than a cell in a timestep
        # It is a cell nearer than it is believed to be.
        pytest.param("house-960005", 3515088548, 43.5, marks=pytest.mark.slow),
    ],
)
def test_a_child_that_heads_for_the_robot_out_of_the_picture_is_not_struck(house, seed, seconds):
    env = caregiver_mj.load("supervise", house, "adversary:0.25", sight="camera", visuals=False)
    env.task.reseed(episode_random(seed))
    episode(env, seconds=seconds)
    outcome = env.task.outcome()
    assert outcome["contact_seconds"] > 0.0
    assert outcome["strikes"] == 0


def test_it_goes_back_gently_where_a_child_was_or_may_be():
    seen, clearance = view(), Clearance(ROOMS, ROBOT)
    seen.lurking = (child(0.4, 0.0),)
    assert separation.gap(seen, ROBOT, seen.unseen) == np.inf  # it would see it come
    seen.gaze = 0.0
    there_too = separation.catch_up_speed(separation.gap(seen, ROBOT, seen.unseen), separation.ADDED)
    assert there_too < 0.02  # with a creep it is no strike
    left = lambda: separation.restrain(seen, ROBOT, clearance, 0.02, False, (0.2, 0.0), (0.0, 0.0))[0]  # noqa: E731
    assert left() == (0.2, 0.0)
    seen.hidden = seen.lurking
    assert left() == (0.0, 0.0)


def test_a_cell_is_empty_if_it_is_seen_while_a_child_would_be_in_it(perception):
    east, west = (4, 10), (4, 3)
    chance = lambda cell: perception._tracker.presence[0, 0, ROOMS.cell_index[cell]]  # noqa: E731
    for clock, known in ((0.4, False), (0.2, True)):  # a child on its way may be in neither cell
        believe(perception, east, west)
        perception._gone, perception._begun = clock, 0
        perception.watch(perception.look(observed(seen=[east]), 0.3), clock)
        assert (chance(east) == 0.0) == known
    assert chance(west) == pytest.approx(1.0)


def test_a_child_that_something_hides_for_a_moment_is_not_forgotten():
    env = load(0.5, 7, "walls")
    policy, first = caregiver_mj.CaregiverPolicy(env, "nearest"), env.reset()
    base = first.observation["base_position"][:2]

    def views(step_type, seen):
        """Return how far away children are that are seen, and that may be there unseen."""
        observation = dict(first.observation, toddler_seen=np.array([float(seen)]))
        observation["toddler_position"] = seen * np.array([base[0] + 1.5, base[1], 0.0])
        policy(first._replace(observation=observation, step_type=step_type))
        view, *_ = policy._seen
        return [[math.dist(child.position, base) for child in some] for some in (view.children, view.hidden)]

    assert views(dm_env.StepType.FIRST, True) == [[pytest.approx(1.5)], []]
    policy.robot.now = 1.0
    assert views(dm_env.StepType.MID, False) == [[], [pytest.approx(1.5 - BUMP_SPEED)]]  # it may have come on
    policy.robot.now = 3.0
    assert views(dm_env.StepType.MID, False) == [[], []]  # not for ever: then it is where it is believed to be


def test_a_candle_in_the_hand_is_seen_over_a_wall():
    env = load(0.5, 7)
    env.reset()
    x, y = ROOMS.position((1, 4))
    env.physics.set_robot(np.array([x + 0.1, y, 0.0]))
    env.physics.set_candle(0, np.array([x + 1.0, y, 0.9]), 0.0)  # beyond the wall of the first room
    for _ in range(10):
        env.step(np.zeros(env.action_spec().shape))
    shown = env.task.get_observation(env.physics)["candle_position"][0]
    assert shown[:2] == pytest.approx(env.physics.candle_poses()[0, :2], abs=0.01)


def test_a_child_on_its_way_to_a_corner_may_come_round_it():
    perception = Perception(ROOMS, sight=Sight.of("walls"))
    perception.reset(observed())
    corridor = tuple(cell for cell in ROOMS.free_cells if cell[0] == 4)
    for now, (cell, places) in enumerate([((3, 8), 1), ((2, 8), 1), ((1, 8), 0)]):
        believe(perception, cell)
        view = perception.look(observed(seen=corridor), float(now))
        assert len(view.lurking) == places


def test_a_child_that_runs_into_the_robot_stays_where_it_is(perception):
    seen = observed()
    x, y = ROOMS.position((4, 8))
    seen |= {"toddler_seen": np.ones(1), "toddler_position": np.array([x, y, 0.0])}
    perception.reset(seen)
    perception.watch(perception.look(seen, 0.0), 0.0)
    seen["toddler_position"] = np.array([x - 0.1, y, 0.0])
    perception.watch(perception.look(seen, 0.3), 0.2)
    assert perception._tracker.cell == ROOMS.cell_index[(4, 8)]
