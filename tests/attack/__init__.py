"""An attack on prover and checker that can be run for as long as one likes: `make attack`."""
