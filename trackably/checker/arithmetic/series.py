"""Power series, coefficient by coefficient."""

from trackably.checker.arithmetic.intervals import Real, dot, exp, log


def exp_series(g: list[Real], n: int) -> list[Real]:
    """Return n coefficients of f = e^g, from f' = g' f."""
    f, slope = [exp(g[0])], [j * coefficient for j, coefficient in enumerate(g)]
    for k in range(1, n):
        f.append(dot(slope[1 : k + 1], f[max(0, k + 1 - len(g)) : k][::-1]) / k)
    return f


def power_series(q: list[Real], a: Real, n: int) -> list[Real]:
    """Return n coefficients of f = q^a, from q f' = a q' f."""
    f = [exp(a * log(q[0]))]
    for k in range(1, n):
        slope = [(a * j - (k - j)) * q[j] for j in range(1, min(k + 1, len(q)))]
        f.append(dot(slope, f[max(0, k + 1 - len(q)) : k][::-1]) / (k * q[0]))
    return f


def times(f: list[Real], g: list[Real], n: int) -> list[Real]:
    """Return n coefficients of f g: Σ_j f_j g_(k − j) for k < n."""
    return [dot(f[max(0, k + 1 - len(g)) : k + 1], g[max(0, k + 1 - len(f)) : k + 1][::-1]) for k in range(n)]
