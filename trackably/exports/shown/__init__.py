"""What a notebook shows of a reference: a table of its bounds with small pictures, and a figure."""
