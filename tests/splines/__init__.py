"""Random splines and systems, with bounds just inside and just outside of the true extremes."""
