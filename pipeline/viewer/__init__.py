"""What Lichtblick and Foxglove show of an experiment's logs: its scene, its events, and the layout of panels."""
