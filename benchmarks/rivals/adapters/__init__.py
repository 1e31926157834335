"""One file a rival: it takes a problem, and answers in its own way."""
