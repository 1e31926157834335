"""An attack on what proposes proofs and on the checker, that can be run for as long as one likes: `make attack`."""
