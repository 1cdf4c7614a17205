"""Writing models and images to files."""
