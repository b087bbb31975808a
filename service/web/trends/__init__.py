"""Requests for how jobs fared in; pages of trends, shift reports and their figures out."""
