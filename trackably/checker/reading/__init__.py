"""Read what a certificate's JSON says: the boundary between untyped data and typed mathematics."""
