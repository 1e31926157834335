"""Ways to factor K + σ_n² I, and the choice of the cheapest that is exact enough."""
