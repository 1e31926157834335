"""What viewers show of an experiment in space and in words: scene, vehicle, proofs and refusals."""
