"""The figures and tables of the page on methods, drawn from blocks rendered for it."""
