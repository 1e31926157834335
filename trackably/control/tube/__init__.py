"""Tube model predictive control: a nominal plan on the reference, and a feedback that keeps the state near it."""
