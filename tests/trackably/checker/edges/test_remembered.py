"""What the checker remembers of one plant it says of no other one."""

import json
from dataclasses import replace

import pytest

from tests.project import ROOT
from trackably.checker.flatness import why_not_flat
from trackably.checker.form import read_certificate

FILE = ROOT / "data/results/mobile-robot/certificates/joint.json"
CHANGES = {
    "f": lambda system, flat: (replace(system, f=(system.f[1], system.f[0], *system.f[2:])), flat),
    "states": lambda system, flat: (system, replace(flat, states=(flat.states[1], flat.states[0], *flat.states[2:]))),
    "inputs": lambda system, flat: (system, replace(flat, inputs=flat.inputs[::-1])),
    "angles": lambda system, flat: (system, replace(flat, angles=())),
    "names": lambda system, flat: (replace(system, states=system.states[1:] + system.states[:1]), flat),
}


@pytest.mark.parametrize("change", CHANGES)
def test_another_plant_is_looked_at_again(change):
    data = json.loads(FILE.read_text())
    for _ in range(2):
        system = read_certificate(data).subject.system
        assert why_not_flat(system, system.flat) is None
        assert why_not_flat(*CHANGES[change](system, system.flat)) is not None
