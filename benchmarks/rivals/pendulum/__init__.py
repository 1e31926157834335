"""The pendulum of P.-C. Aubin-Frankowski (SIAM J. Control Optim. 59, 2021, 2693–2716), with its printed numbers.

x″ = −10 x + w, w′ = u on [0, 1] with x(0) = 0.5, x′(0) = 0, w(0) = 0, x(1/3) = 0.5, x(1) = 0, x′ ≥ −3 and |w| ≤ 10 at
all times; minimise −100 x′(1) + 10⁻⁴ ∫ u².
"""
