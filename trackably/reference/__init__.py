"""Learn a reference with a proof from samples: the user's input, the prior, the search, the verdict, the result."""
