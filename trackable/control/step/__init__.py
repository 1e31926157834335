"""One step of a controller: its convex programs, and the answer that they give."""
