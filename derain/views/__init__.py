"""Views of a scan for networks and filters, and the back-projection to its points."""
