"""What commands share: their answer, progress, interruption, and the folder that a PATH means."""
