"""Many recordings at once: references, certificates and one table."""
