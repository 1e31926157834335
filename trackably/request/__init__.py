"""The arguments of `learn_reference` and similar functions, checked where they enter."""
