"""Tracking model predictive control on a reference: where trackability pays."""
