"""The steps of the proof, in the order of the theorem's proof."""
