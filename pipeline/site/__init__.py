"""The report: a static site of the documentation and the results, which needs neither a server nor a network."""
