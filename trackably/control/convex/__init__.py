"""Convex programs whose numbers change from step to step while their structure stays."""
