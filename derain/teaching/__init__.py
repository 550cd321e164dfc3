"""Labels of a teacher: rain, not rain, or not known, and what of them a student trains on."""
