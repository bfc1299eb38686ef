"""What values show of themselves: plots, drawn graphs, HTML for notebooks, reports.

Knows all kinds of values; runs nothing but what a report asks for.
"""
