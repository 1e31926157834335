"""The files of one experiment below data/results: what one stage writes, the next one reads."""

from dataclasses import dataclass
from pathlib import Path

TIMINGS, ENVIRONMENT = "timings.json", "environment.json"


@dataclass(frozen=True)
class Results:
    """Paths of what the stages of an experiment write, below `root`, and the `parameters` that its logs name.

    Each log names them, so that all that is made from it is made again where they change.
    """

    experiment: str
    root: Path = Path("data/results")
    parameters: str = ""

    @property
    def folder(self) -> Path:
        return self.root / self.experiment

    def log(self, stage: str) -> Path:
        return self.folder / f"{stage}.mcap"

    @property
    def iterations(self) -> Path:
        return self.folder / "iterations.csv"

    @property
    def metrics(self) -> Path:
        return self.folder / "metrics.json"

    @property
    def summary(self) -> Path:
        """The few numbers that tell the experiment: the metric that DVC shows."""
        return self.folder / "summary.json"

    @property
    def margins(self) -> Path:
        """The smallest margins over time, as a table for DVC's plots."""
        return self.folder / "margins.csv"

    @property
    def control(self) -> Path:
        return self.folder / "control.json"

    @property
    def timings(self) -> Path:
        """Wall-clock times of one run on one machine: neither committed nor compared."""
        return self.folder / TIMINGS

    @property
    def environment(self) -> Path:
        """Versions and kernels that the fit was made with."""
        return self.folder / ENVIRONMENT

    @property
    def layout(self) -> Path:
        """The layout for viewers of the logs."""
        return self.folder / "layout.json"

    def counterexample(self, method: str) -> Path:
        return self.folder / "certificates" / f"{method}.counterexample.json"

    def certificate(self, method: str) -> Path:
        return self.folder / "certificates" / f"{method}.json"

    @property
    def figures(self) -> Path:
        return self.folder / "figures"

    def figure(self, name: str) -> Path:
        return self.figures / f"{name}.svg"
