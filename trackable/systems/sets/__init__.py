"""State and input sets: intervals, boxes, polytopes; redundant inputs."""
