"""How deep the finger pads are in the wax, as the house's physics options see it."""

import mujoco

import caregiver_mj

# A grasp in the middle of an episode, pads 0.07 mm in the wax: positions, metres, and quaternions of wax and pads.
WAX = (
    (2.1207237247473003, -4.728747904595135, 0.8332075669866753),
    (0.9675994974417166, 0.0007332328299422369, 0.001713950685238936, 0.2524831425921403),
)
PADS = (
    (
        (2.1076392298695605, -4.755655676229092, 0.8507630677947854),
        (0.00030769272280525834, 0.8881129018075454, -0.0012274295914277975, 0.4596236203512255),
    ),
    (
        (2.107771892521534, -4.7017944310828454, 0.8507944031854572),
        (0.4596236203506733, 0.0012274279973570454, 0.8881129018097484, -0.00030769354778209274),
    ),
)


def test_a_pad_that_presses_the_wax_is_not_taken_for_one_deep_inside_it():
    """At MuJoCo's default `ccd_tolerance` one of them is, by 10 mm, and the fingers jump."""
    options = caregiver_mj.load("supervise", random=0).physics.model.opt
    spec = mujoco.MjSpec()
    spec.option.ccd_tolerance = options.ccd_tolerance
    spec.option.ccd_iterations = options.ccd_iterations
    spec.option.enableflags = options.enableflags
    spec.option.disableflags = options.disableflags
    wax = spec.worldbody.add_body(pos=WAX[0], quat=WAX[1])
    wax.add_freejoint()
    wax.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=(0.022, 0.08, 0.0))
    for position, quaternion in PADS:
        pad = spec.worldbody.add_body(pos=position, quat=quaternion, mocap=True)
        pad.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=(0.011, 0.005, 0.015))
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon == 4
    assert min(contact.dist for contact in data.contact) > -0.0001
