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
MOVEIT = """
joint_limits:
  shoulder:
    has_velocity_limits: true
    max_velocity: 2.175
    has_acceleration_limits: true
    max_acceleration: 3
    has_jerk_limits: false
    max_jerk: 7
  wrist: {has_position_limits: true, min_position: -1, max_position: 2, has_jerk_limits: true, max_jerk: 300}
"""
CONTROL = """
/**:
  ros__parameters:
    joint_limits:
      wheel: {angle_wraparound: true, has_velocity_limits: true, max_velocity: !degrees 180.0,
        has_acceleration_limits: true, max_acceleration: 5.0, has_deceleration_limits: true, max_deceleration: 2.5,
        has_soft_limits: true}
"""


def file(folder, name, text):
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def test_a_urdf_says_positions_and_velocities(tmp_path):
    joints = Joints.from_urdf(file(tmp_path, "arm.urdf", URDF), acceleration={"shoulder": 4.0})
    assert joints.names == ("shoulder", "wheel", "free", "slide")
    assert joints.continuous == {"wheel", "free"}
    assert joints.position.tolist() == [[-1.5, 2.0], [-np.inf, np.inf], [-np.inf, np.inf], [0.0, 0.3]]
    assert joints.velocity[:, 1].tolist() == [1.2, 5.0, np.inf, 0.1]
    assert joints.order == 2


def test_joint_limits_are_read_as_moveit_and_ros2_control_write_them(tmp_path):
    joints = Joints.from_joint_limits_yaml(file(tmp_path, "joint_limits.yaml", MOVEIT))
    assert joints.names == ("shoulder", "wrist")
    assert joints.velocity[:, 1].tolist() == [2.175, np.inf]
    assert joints.jerk[:, 1].tolist() == [np.inf, 300.0]
    assert joints.position[1].tolist() == [-1.0, 2.0]
    wheel = Joints.from_joint_limits_yaml(file(tmp_path, "control.yaml", CONTROL))
    assert wheel.continuous == {"wheel"}
    assert wheel.velocity.tolist() == [[-np.pi, np.pi]]
    assert wheel.acceleration.tolist() == [[-2.5, 2.5]]


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
    "entities": ("a.urdf", DOCTYPE, "without <!DOCTYPE, <!ENTITY"),
    "no limit": ("a.urdf", LIMITLESS, "joint 'a' is revolute, and needs a <limit>"),
    "a limit in words": ("a.yaml", "joint_limits: {a: {has_jerk_limits: true, max_jerk: x}}", "a: max_jerk: expected"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG_FILES)
def test_a_wrong_file_is_refused_in_a_sentence(name, tmp_path):
    called, text, said = WRONG_FILES[name]
    read = Joints.from_urdf if called.endswith("urdf") else Joints.from_joint_limits_yaml
    with pytest.raises(InputError, match=called) as refused:
        read(file(tmp_path, called, text))
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)
