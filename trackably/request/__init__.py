"""What users ask of `learn_reference` and the like, checked where it enters."""
