"""Joints: limits from descriptions of robots, and the chains of integrators that follow commands."""

import numpy as np
import pytest

from trackably import Joints, LinearSystem
from trackably.errors import InputError

URDF = """<?xml version="1.0"?>
<robot name="arm">
  <link name="base"/>
  <joint name="fixed" type="fixed"/>
  <joint name="shoulder" type="revolute"><limit lower="-1.5" upper="2" effort="9" velocity="1.2"/></joint>
  <joint name="wheel" type="continuous"><limit effort="9" velocity="5"/></joint>
  <joint name="free" type="continuous"/>
  <joint name="slide" type="prismatic"><limit upper="0.3" effort="9" velocity="0.1"/></joint>
  <joint name="copy" type="revolute"><limit lower="0" upper="1" effort="9" velocity="1"/><mimic joint="slide"/></joint>
</robot>
"""


def file(folder, name, text):
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def test_a_urdf_says_positions_and_velocities(tmp_path):
    arm = file(tmp_path, "arm.urdf", URDF)
    joints = Joints.from_urdf(arm, acceleration={"shoulder": 4.0})
    assert joints.names == ("shoulder", "wheel", "free", "slide")
    assert joints.continuous == {"wheel", "free"}
    assert joints.position.tolist() == [[-1.5, 2.0], [-np.inf, np.inf], [-np.inf, np.inf], [0.0, 0.3]]
    assert joints.velocity[:, 1].tolist() == [1.2, 5.0, np.inf, 0.1]
    assert joints.order == 2
    with pytest.raises(InputError, match=r"acceleration: there is no joint 'elbow', only shoulder, wheel"):
        Joints.from_urdf(arm, acceleration={"elbow": 4.0})


def test_a_plant_is_a_chain_of_integrators_for_each_joint():
    joints = Joints(position=[(-1, 1), (-2, 3)], velocity=1.0, acceleration=2.0, jerk=3.0, names=["a", "b"])
    plant, chain = joints.plant(0.1), LinearSystem.discretised(np.eye(3, k=1), np.eye(3)[:, -1:], 0.1)
    np.testing.assert_allclose(plant.linear.A, np.kron(np.eye(2), chain.A), rtol=1e-12)
    np.testing.assert_allclose(plant.linear.B, np.kron(np.eye(2), chain.B), rtol=1e-12)
    assert plant.input_set.upper.tolist() == [3.0, 3.0]
    assert plant.state_set.upper.tolist() == [1.0, 1.0, 2.0, 3.0, 1.0, 2.0]


DOCTYPE = '<!DOCTYPE robot [<!ENTITY a "aaaa">]><robot name="&a;"/>'
LIMITLESS = '<robot><joint name="a" type="revolute"/></robot>'
WRONG_FILES = {
    "entities": (DOCTYPE, "without <!DOCTYPE, <!ENTITY"),
    "no limit": (LIMITLESS, "joint 'a' is revolute, and needs a <limit>"),
    "a limit in words": (LIMITLESS.replace("/></r", '><limit velocity="x"/></joint></r'), "velocity: expected a"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG_FILES)
def test_a_wrong_file_is_refused_in_a_sentence(name, tmp_path):
    text, said = WRONG_FILES[name]
    with pytest.raises(InputError, match=r"a\.urdf") as refused:
        Joints.from_urdf(file(tmp_path, "a.urdf", text))
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)
