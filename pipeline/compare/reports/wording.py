"""Put values, rows and verdicts in words, for reports of every format."""

from pipeline.compare.model import Absent, Comparison, Difference, Found, JudgedClaim, Row, Status, Verdict

_LONG = 48


def shown(value: Found) -> str:
    """Show a value with all its digits; long text is cut."""
    if isinstance(value, Absent):
        return "absent"
    text = "null" if value is None else repr(value)
    return text if len(text) <= _LONG else f"{text[: _LONG - 1]}…"


def differing_text(base: Found, new: Found) -> tuple[str, str]:
    """Show two values; long texts are cut such that the first difference is seen."""
    if isinstance(base, str) and isinstance(new, str) and max(len(base), len(new)) > _LONG - 2:
        start = next((i for i, (a, b) in enumerate(zip(base, new, strict=False)) if a != b), min(len(base), len(new)))
        start = max(0, start - 8)
        return ("…" if start else "") + shown(base[start:]), ("…" if start else "") + shown(new[start:])
    return shown(base), shown(new)


def size(difference: Difference | None) -> tuple[str, str]:
    """Show the absolute and the relative difference; a dash where there is none."""
    absolute, relative = (difference.absolute, difference.relative) if difference else (None, None)
    return "–" if absolute is None else f"{absolute:.2g}", "–" if relative is None else f"{relative:.2g}"


def allowed(difference: Difference) -> str:
    """Show how far the values may be apart, and the rule that says so."""
    rule = difference.rule
    return f"no change ({rule.name})" if difference.absolute is None else str(rule)


def extent(row: Row) -> str:
    """Say how many values of a row differ."""
    if not row.differing:
        return ""
    of = f"{row.differing} of {row.compared} values differ"
    return of + (f", {row.beyond} beyond tolerance" if row.beyond else "")


def verdict(found: Verdict) -> str:
    """Say pass or fail, with the value or the reason why there is none."""
    word = "pass" if found.holds else "FAIL"
    value = f"{found.found:.10g}" if isinstance(found.found, float) else shown(found.found)
    return f"{word}: {found.reason or value}"


def closing(comparison: Comparison) -> str:
    """Return one line with all counts."""
    rows = ", ".join(f"{number} {status.value}" for status, number in comparison.counts.items())
    claims = comparison.claims
    held = [sum(side.holds for side in sides) for sides in zip(*((c.base, c.new) for c in claims), strict=True)]
    told = f"; of {len(claims)} claims {held[0]} hold in BASE and {held[1]} in NEW" if claims else ""
    return f"{rows}{told}: {'within tolerance' if comparison.within else 'NOT within tolerance'}"


def remarkable(comparison: Comparison) -> list[Row]:
    """Return the rows that are not identical, the worst first."""
    order = (Status.DIFFERENT, Status.MISSING, Status.EXTRA, Status.WITHIN)
    return sorted((r for r in comparison.rows if r.status in order), key=lambda row: order.index(row.status))


def beyond(comparison: Comparison) -> list[Row]:
    """Return the rows that are neither identical nor within tolerance, the worst first."""
    return [row for row in remarkable(comparison) if row.status is not Status.WITHIN]


def everything(comparison: Comparison) -> tuple[Row, ...]:
    """Return all rows."""
    return comparison.rows


def failing(claims: tuple[JudgedClaim, ...]) -> list[JudgedClaim]:
    """Return the claims that fail on one side or both."""
    return [claim for claim in claims if not (claim.base.holds and claim.new.holds)]
