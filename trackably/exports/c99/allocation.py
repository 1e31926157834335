"""Redundant inputs in C: the smallest input in U of those that act alike, by the laws of `systems.allocation`."""

from trackably.exports.c99.numerals import array, number
from trackably.systems.allocation import ROUNDING, Allocation

_FUNCTION = """\
// Puts the smallest admissible input that acts as u does in the place of u.
static inline void NAME_smallest(double *u)
{
    int inside = 1;
    for (int r = 0; r < ROWS; ++r) {
        double value = 0.0;
        for (int j = 0; j < COUNT; ++j) value += NAME_rows[COUNT * r + j] * u[j];
        if (value < NAME_lower[r] || value > NAME_upper[r]) inside = 0;
    }
    if (inside) return;
    double least = INFINITY, size = INFINITY, found[COUNT] = {0.0};
    for (int c = 0; c < LAWS; ++c) {
        double v[COUNT], gross[COUNT], beyond = 0.0, square = 0.0;
        for (int i = 0; i < COUNT; ++i) {
            v[i] = NAME_shifts[COUNT * c + i];
            gross[i] = fabs(v[i]);
            for (int j = 0; j < COUNT; ++j) {
                const double term = NAME_gains[COUNT * (COUNT * c + i) + j] * u[j];
                v[i] += term;
                gross[i] += fabs(term);
            }
            square += v[i] * v[i];
        }
        for (int r = 0; r < ROWS; ++r) {
            double value = 0.0, rounding = 0.0;
            for (int j = 0; j < COUNT; ++j) {
                value += NAME_rows[COUNT * r + j] * v[j];
                rounding += fabs(NAME_rows[COUNT * r + j]) * gross[j];
            }
            const double excess = fmax(value - NAME_upper[r], NAME_lower[r] - value) - TOLERATED * rounding;
            beyond = fmax(beyond, excess / (NAME_upper[r] - NAME_lower[r]));
        }
        if (beyond < least || (beyond <= least && square < size)) {
            least = beyond;
            size = square;
            for (int i = 0; i < COUNT; ++i) found[i] = v[i];
        }
    }
    for (int i = 0; i < COUNT; ++i) u[i] = found[i];
}
"""


def allocation_function(allocation: Allocation, name: str) -> list[str]:
    """Return the lines of `static inline void name_smallest(double *u)` and its numbers."""
    laws, bounded = allocation.laws, allocation.input_set
    numbers = {"rows": bounded.rows, "lower": bounded.lower, "upper": bounded.upper}
    numbers |= {"gains": laws.gains, "shifts": laws.shifts}
    found = [line for what, values in numbers.items() for line in array(f"{name}_{what}", values.ravel().tolist())]
    sizes = {"ROWS": str(len(bounded.rows)), "COUNT": str(bounded.dimension), "LAWS": str(len(laws.shifts))}
    text = _FUNCTION
    for word, value in {**sizes, "TOLERATED": number(ROUNDING), "NAME": name}.items():
        text = text.replace(word, value)
    return [*found, "", *text.splitlines(), ""]
