"""Values as HTML for notebooks, and the report of a scene."""
