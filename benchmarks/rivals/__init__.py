"""Everything that hands out trajectories, side by side: what it promises, and what it does."""
