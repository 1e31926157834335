"""What results depend on beside code and parameters: the processor's instructions, and versions of packages."""
