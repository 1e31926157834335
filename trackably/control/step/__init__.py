"""One step of a controller: its convex programs, and the plan or the explanation that they give."""
