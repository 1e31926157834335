"""Write a comparison as JSON, for programs."""

from typing import Any

from pipeline.compare.model import ABSENT, Comparison, Difference, Found, JudgedClaim, Row, Verdict
from pipeline.compare.reports.wording import closing
from trackably.files import to_json


def to_record(comparison: Comparison) -> bytes:
    """Return everything that the comparison holds. An absent value has no key; NaN and infinities are text."""
    return to_json(
        {
            "base": comparison.base,
            "new": comparison.new,
            "within_tolerance": comparison.within,
            "summary": closing(comparison),
            "notes": list(comparison.notes),
            "counts": {status.value: number for status, number in comparison.counts.items()},
            "artifacts": [_row(row) for row in comparison.rows],
            "claims": [_claim(claim) for claim in comparison.claims],
            "environment": [
                {"name": v.name, "base": v.base, "new": v.new, "differs": v.differs} for v in comparison.environment
            ],
        }
    )


def _row(row: Row) -> dict[str, Any]:
    return {
        "artifact": row.artifact,
        "topic": row.topic,
        "field": row.field,
        "status": row.status.value,
        "compared": row.compared,
        "differing": row.differing,
        "beyond_tolerance": row.beyond,
        "worst": [_difference(difference) for difference in row.worst],
        "largest_absolute": row.largest_absolute and _difference(row.largest_absolute),
        "largest_relative": row.largest_relative and _difference(row.largest_relative),
        "notes": list(row.notes),
    }


def _difference(difference: Difference) -> dict[str, Any]:
    rule = difference.rule
    return {
        "place": difference.place,
        **_value("base", difference.base),
        **_value("new", difference.new),
        "absolute": difference.absolute,
        "relative": difference.relative,
        "tolerance": {"rule": rule.name, "absolute": rule.absolute, "relative": rule.relative},
    }


def _claim(claim: JudgedClaim) -> dict[str, Any]:
    return {
        "claim": claim.text,
        "source": claim.source,
        "expected": claim.expected,
        "base": _verdict(claim.base),
        "new": _verdict(claim.new),
    }


def _verdict(verdict: Verdict) -> dict[str, Any]:
    return {"holds": verdict.holds, **_value("value", verdict.found), "reason": verdict.reason}


def _value(name: str, value: Found) -> dict[str, Any]:
    if value is ABSENT:
        return {}
    strange = isinstance(value, float) and not abs(value) < float("inf")
    return {name: str(value) if strange else value}
