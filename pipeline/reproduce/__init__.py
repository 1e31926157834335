"""Every stage from nothing, in a copy of the project, compared with the results that are here."""
