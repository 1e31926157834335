"""What an experiment claims of its certified references, as written in params.yaml."""

import math
from typing import Annotated

from pydantic import BeforeValidator

from trackably.arguments import is_number
from trackably.certificates.goal import Claim


def parse_claim(written: object) -> Claim:
    """Read `all_times`, `all_phases` or `{window: [start, end]}` [s]. Raises ValueError for anything else."""
    match written:
        case "all_times" | "all_phases":
            return written
        case {"window": [int() | float() as start, int() | float() as end], **rest} if not rest:
            if not (
                is_number(start) and is_number(end) and math.isfinite(start) and math.isfinite(end) and start < end
            ):
                raise ValueError(f"window: expected start < end, got {start} and {end}")
            return float(start), float(end)
    raise ValueError("expected all_times, all_phases or {window: [start, end]}")


ClaimField = Annotated[Claim, BeforeValidator(parse_claim)]
