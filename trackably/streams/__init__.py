"""Streams of samples that are longer than the memory of their kernel: learned window by window, proved as a whole."""
