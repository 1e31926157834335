"""Streams of samples much longer than the memory of their kernel: learned window by window, proved as a whole."""
