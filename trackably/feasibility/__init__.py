"""Whether there is any reference at all, whatever kernel and samples: asked of the system before one is sought."""
