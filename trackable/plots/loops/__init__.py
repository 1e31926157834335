"""Figures of closed loops."""
