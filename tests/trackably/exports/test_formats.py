"""What other tools are handed is the reference at its steps, in files to the last bit, read by other readers."""

import csv
from pathlib import Path
from typing import Any

import control
import numpy as np
import pandas as pd
import pyarrow.parquet
import pytest
import yaml
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from tests.trackably.exports.references import EVERY, all_times, on_window
from trackably import JointTrajectory, write_joint_trajectory
from trackably.arrays import Array

FIRST, COUNT = 2, 9
K = np.arange(FIRST, FIRST + COUNT)
UNITS = {"position": "m", "force": "N"}


def of_csv(reference: Any, folder: Path) -> Array:
    with reference.to_csv(folder / "r.csv", FIRST, COUNT).open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    plant = reference.reference.plant
    assert head == ["time [s]", *plant.names]
    np.testing.assert_array_equal([float(row[0]) for row in rows], K * plant.sampling_time)
    return np.array(rows, dtype=float)[:, 1:]


def of_acados(reference: Any, folder: Path) -> Array:
    yref, yref_e = reference.to_acados(COUNT).at(FIRST)
    np.testing.assert_allclose(yref_e, reference.state(FIRST + COUNT), atol=1e-12)
    return yref


def of_control(reference: Any, folder: Path) -> Array:
    return np.vstack(reference.to_control().eval(K * reference.reference.plant.sampling_time)).T


def of_ros2(reference: Any, folder: Path) -> Array:
    """Each state and each input as the position of a joint."""
    joints = {f"of {name}": {"positions": name} for name in reference.reference.plant.names}
    found: Any = yaml.safe_load(reference.to_ros2(folder / "r.yml", joints, FIRST, COUNT).read_text())
    assert found["joint_names"] == [*joints]
    assert found["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    return np.array([point["positions"] for point in found["points"]])


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("read", [of_csv, of_acados, of_control, of_ros2])
def test_states_and_inputs_of_each_step_come_back(read: Any, name: str, tmp_path: Path) -> None:
    reference = EVERY[name]()
    found, wanted = read(reference, tmp_path), np.hstack([reference.state(K), reference.input(K)])
    assert found.shape == wanted.shape
    np.testing.assert_allclose(found, wanted, rtol=0, atol=0 if any(tmp_path.iterdir()) else 1e-12)


def test_parquet_holds_units_and_the_statement(tmp_path: Path) -> None:
    path = on_window().to_parquet(tmp_path / "r.parquet", units=UNITS)
    table = pyarrow.parquet.read_table(path)
    assert table.column_names == ["time [s]", "position [m]", "velocity", "force [N]"]
    assert table.schema.metadata[b"trackably"].decode() == on_window().certificate.explanation
    of_csv = pd.read_csv(on_window().to_csv(tmp_path / "r.csv", units=UNITS))
    pd.testing.assert_frame_equal(pd.read_parquet(path), of_csv, check_exact=True)


def test_control_simulates_the_same_states() -> None:
    reference = all_times()
    system = reference.reference.plant.linear
    theirs = control.ss(system.A, system.B, np.eye(len(system.A)), 0, system.sampling_time)
    times = np.arange(60) * system.sampling_time
    states, inputs = reference.to_control().eval(times)
    simulated = control.input_output_response(theirs, times, inputs, states[:, 0])
    np.testing.assert_allclose(simulated.states, states, atol=1e-9)


def test_an_mcap_file_comes_back(tmp_path: Path) -> None:
    joints, at = (
        {"slide": {"positions": "position", "velocities": "velocity", "effort": "force"}},
        1_700_000_000 * 10**9,
    )
    with on_window().to_ros2(tmp_path / "r.mcap", joints, topic="/slide", stamp=at + 7).open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        ((schema, channel, message, found),) = reader.iter_decoded_messages()
    assert (schema.name, schema.encoding) == ("trajectory_msgs/msg/JointTrajectory", "ros2msg")
    assert (channel.topic, channel.message_encoding, found.joint_names) == ("/slide", "cdr", ["slide"])
    assert message.log_time == message.publish_time == at + 7
    assert (found.header.stamp.sec, found.header.stamp.nanosec) == (1_700_000_000, 7)
    k = np.arange(61)
    values = [[*point.positions, *point.velocities, *point.effort] for point in found.points]
    np.testing.assert_array_equal(values, np.hstack([on_window().state(k), on_window().input(k)]))
    assert not any(len(point.accelerations) for point in found.points)
    since = [point.time_from_start.sec * 10**9 + point.time_from_start.nanosec for point in found.points]
    assert since == [50_000_000 * i for i in k.tolist()]


def test_small_numbers_are_numbers_in_every_yaml(tmp_path: Path) -> None:
    """YAML 1.1 takes 1e-05 for a text: such exponents get a point before them."""
    values = [1e-5, -1e300, 1.5e-7, 0.0, -0.0, 3.0, 5e-324, 1.25e-10]
    given = JointTrajectory([f"1e{i}" for i in range(8)], [0, 1], [[[value]] for value in values])
    found = yaml.safe_load(write_joint_trajectory(given, tmp_path / "r.yaml").read_text())
    assert found["points"][0]["positions"] == values
    assert found["joint_names"] == [*given.names]
