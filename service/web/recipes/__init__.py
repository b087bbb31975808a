"""Recipes on the page: listed, tried on archived jobs, adopted, and taken back."""
