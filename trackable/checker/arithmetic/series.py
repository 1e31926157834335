"""Power series, coefficient by coefficient."""

from trackable.checker.arithmetic.intervals import Real, exp, log, total


def exp_series(g: list[Real], n: int) -> list[Real]:
    """Return n coefficients of f = e^g, from f' = g' f."""
    f, slope = [exp(g[0])], [j * coefficient for j, coefficient in enumerate(g)]
    for k in range(1, n):
        f.append(total(slope[j] * f[k - j] for j in range(1, min(k + 1, len(g)))) / k)
    return f


def power_series(q: list[Real], a: Real, n: int) -> list[Real]:
    """Return n coefficients of f = q^a, from q f' = a q' f."""
    f = [exp(a * log(q[0]))]
    for k in range(1, n):
        f.append(total((a * j - (k - j)) * q[j] * f[k - j] for j in range(1, min(k + 1, len(q)))) / (k * q[0]))
    return f


def times(f: list[Real], g: list[Real], n: int) -> list[Real]:
    """Return n coefficients of f g: Σ_j f_j g_(k − j) for k < n."""
    return [total(f[j] * g[k - j] for j in range(max(0, k + 1 - len(g)), min(k + 1, len(f)))) for k in range(n)]
