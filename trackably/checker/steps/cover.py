"""Steps 1 and 4 of the proof: boxes without gaps cover what is claimed, and a claimed period is that of all kernels."""

from itertools import pairwise

from trackably.checker.certificate import AllPhases, Certificate, Instants


def check_cover(certificate: Certificate) -> str | None:
    """Return where the cover has a gap, or which kernel does not repeat; None where the claim is covered."""
    claim = certificate.claim
    if isinstance(claim, Instants):
        return None
    start, end = claim.span
    if isinstance(claim, AllPhases) and any(s.kernel.repeats_after != end for s in certificate.subject.signals):
        return f"period: a kernel does not repeat after {end!r} s"
    for name, boxes in claim.cover.boxes.items():
        ends = boxes.ends
        if (ends[0], ends[-1], len(ends)) != (start, end, len(boxes.radii) + 1):
            return f"cover: the boxes of the {name} must lead from {start!r} s to {end!r} s, with a radius for each"
        for before, after in pairwise(ends):
            if not before < after:
                return f"cover: the boxes of the {name} are out of order at {after!r} s"
    return None
