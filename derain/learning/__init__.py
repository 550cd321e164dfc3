"""What training is made of: batches, losses, and what is drawn at random."""
