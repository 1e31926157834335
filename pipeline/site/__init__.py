"""The report: a static site from what the stages left, which needs neither a server nor a network."""
