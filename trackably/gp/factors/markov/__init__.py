"""Matérn kernels in linear time and memory: differences of samples that are almost independent, and band matrices."""
