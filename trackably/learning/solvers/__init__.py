"""Solvers of smooth programs with a few variables; they know nothing of what is learned."""
