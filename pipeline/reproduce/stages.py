"""The stages of dvc.yaml, and which of them has to wait for which."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from dvc.exceptions import DvcException
from dvc.repo import Repo

from trackably.errors import InputError


@dataclass(frozen=True)
class Stage:
    """A command, the files and folders that it writes, and the names of the stages whose outputs it reads."""

    name: str
    command: str
    outputs: tuple[Path, ...]
    needs: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Plan:
    """Stages by name, in the order of dvc.yaml."""

    stages: dict[str, Stage]

    @cached_property
    def depths(self) -> dict[str, int]:
        """How many stages the longest chain has that begins with each of them."""
        followers = {
            name: [other for other, stage in self.stages.items() if name in stage.needs] for name in self.stages
        }
        found: dict[str, int] = {}

        def depth(name: str) -> int:
            if name not in found:
                found[name] = 1 + max((depth(follower) for follower in followers[name]), default=0)
            return found[name]

        return {name: depth(name) for name in self.stages}

    def ready(self, begun: set[str], done: set[str]) -> list[Stage]:
        """Return the stages that can begin, those with the longest chains behind them first."""
        waiting = [stage for name, stage in self.stages.items() if name not in begun and stage.needs <= done]
        return sorted(waiting, key=lambda stage: -self.depths[stage.name])


def plan_of(project: Path) -> Plan:
    """Return the stages as DVC resolves them for the experiments of params.yaml. Raises InputError."""
    try:
        with Repo(str(project)) as repository:
            graph = repository.index.graph
            return Plan(
                {
                    stage.addressing: Stage(
                        stage.addressing,
                        str(stage.cmd),
                        tuple(Path(output.fspath).relative_to(project.resolve()) for output in stage.outs),
                        frozenset(needed.addressing for needed in graph.successors(stage)),
                    )
                    for stage in repository.index.stages
                }
            )
    except DvcException as error:
        raise InputError(f"dvc.yaml: {error}") from error
